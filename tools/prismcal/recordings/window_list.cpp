// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/window_list.hpp"

#include <algorithm>
#include <utility>

#include "compensation/sample.hpp"

namespace prism::recordings {

using compensation::SensorWindow, compensation::Window, compensation::WindowState;

void WindowList::push_back(const Window& window) {
  windows_.push_back({window.second_mean.second, window.rate_deg_per_h, window.temperature_degc,
                      window.slope_degc_per_s, window.uhfo_v, window.warm_s, window.lag_settling,
                      window.state == WindowState::kReady});
  const auto push_lags = [this](const std::vector<double>& lags) {
    for (std::size_t i = 0; i < lags_; ++i) values_.push_back(i < lags.size() ? lags[i] : kUnknown);
  };
  push_lags(window.lag_degc);
  for (std::size_t i = 0; i < sensors_; ++i) {
    const SensorWindow sensor = i < window.sensors.size() ? window.sensors[i] : SensorWindow{};
    values_.insert(values_.end(), {sensor.mean, sensor.slope_per_s});
    push_lags(sensor.lag);
  }
}

Window WindowList::operator[](std::size_t index) const {
  const Compact& compact = windows_[index];
  Window window;
  window.second_mean.second = compact.second;
  window.state = compact.ready ? WindowState::kReady : WindowState::kWarming;
  window.warm_s = compact.warm_s;
  window.rate_deg_per_h = compact.rate_deg_per_h;
  window.temperature_degc = compact.temperature_degc;
  window.slope_degc_per_s = compact.slope_degc_per_s;
  window.uhfo_v = compact.uhfo_v;
  window.lag_settling = compact.lag_settling;
  auto value = values_.begin() + static_cast<std::ptrdiff_t>(index * (lags_ + sensors_ * (2 + lags_)));
  const auto end_of_lags = [&] { return value + static_cast<std::ptrdiff_t>(lags_); };
  window.lag_degc.assign(value, end_of_lags());
  value = end_of_lags();
  for (std::size_t i = 0; i < sensors_; ++i) {
    SensorWindow sensor{value[0], value[1], {}};
    value += 2;
    sensor.lag.assign(value, end_of_lags());
    value = end_of_lags();
    window.sensors.push_back(std::move(sensor));
  }
  return window;
}

std::size_t WindowList::first_at(std::int64_t second, std::size_t from) const {
  const auto found =
      std::lower_bound(windows_.begin() + static_cast<std::ptrdiff_t>(from), windows_.end(), second,
                       [](const Compact& window, std::int64_t wanted) { return window.second < wanted; });
  return static_cast<std::size_t>(found - windows_.begin());
}

}  // namespace prism::recordings
