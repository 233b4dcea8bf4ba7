// SPDX-License-Identifier: MIT
// Windows of one feature definition in 50 bytes each: a year has 315 000 blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "compensation/features.hpp"

namespace prism::recordings {

/// Keeps the second, the features and the state of the history of each window. Other members, those of its second mean,
/// have their default values when a window is returned; lags and sensors that a window lacks are kUnknown.
class WindowList {
 public:
  WindowList() = default;
  explicit WindowList(const compensation::FeatureDefinition& definition)
      : lags_(definition.lag_time_constants_s.size()), sensors_(definition.sensors.size()) {}

  void reserve(std::size_t windows) { windows_.reserve(windows); }
  void push_back(const compensation::Window& window);
  std::size_t size() const { return windows_.size(); }
  bool empty() const { return windows_.empty(); }
  std::int64_t second(std::size_t index) const { return windows_[index].second; }
  bool lag_settling(std::size_t index) const { return windows_[index].lag_settling; }
  double uhfo_v(std::size_t index) const { return windows_[index].uhfo_v; }
  compensation::Window operator[](std::size_t index) const;
  /// Index of the first window, from index `from` on, at this second or later; size() if there is none. Requires
  /// windows in order of time.
  std::size_t first_at(std::int64_t second, std::size_t from = 0) const;

 private:
  struct Compact {
    std::int64_t second = 0;
    double rate_deg_per_h = 0, temperature_degc = 0, slope_degc_per_s = 0, uhfo_v = 0;
    int warm_s = 0;
    bool lag_settling = false, ready = false;
  };
  std::size_t lags_ = 0, sensors_ = 0;
  std::vector<Compact> windows_;
  std::vector<double> values_;  ///< lags, and mean, slope and lags of each sensor
};

}  // namespace prism::recordings
