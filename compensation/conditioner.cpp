// SPDX-License-Identifier: MIT
#include "compensation/conditioner.hpp"

#include <algorithm>
#include <cmath>

namespace prism {
namespace {

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    if (!std::isfinite(value)) return;
    sum += value;
    ++count;
  }
  double value() const { return count > 0 ? sum / count : kUnknown; }
};

// Mean temperature of the buckets in (last - length, last]; kUnknown where there is none.
double mean_temperature(const std::deque<Bucket>& history, std::int64_t last, int length) {
  Mean mean;
  for (const Bucket& bucket : history) {
    if (bucket.second > last - length && bucket.second <= last) mean.add(bucket.temperature_degc);
  }
  return mean.value();
}

// Slope of the least-squares line through (second, T).
double least_squares_slope(const std::deque<Bucket>& history, std::int64_t last, int length) {
  Mean time, temperature;
  const auto inside = [&](const Bucket& bucket) {
    return bucket.second > last - length && std::isfinite(bucket.temperature_degc);
  };
  for (const Bucket& bucket : history) {
    if (!inside(bucket)) continue;
    time.add(static_cast<double>(bucket.second - last));
    temperature.add(bucket.temperature_degc);
  }
  double covariance = 0, variance = 0;
  for (const Bucket& bucket : history) {
    if (!inside(bucket)) continue;
    const double dt = static_cast<double>(bucket.second - last) - time.value();
    covariance += dt * (bucket.temperature_degc - temperature.value());
    variance += dt * dt;
  }
  return variance > 0 ? covariance / variance : kUnknown;
}

}  // namespace

Conditioner::Conditioner(FeatureDefinition definition) : definition_(std::move(definition)) { reset(); }

void Conditioner::reset() {
  history_.clear();
  lag_mean_degc_.clear();
  lag_age_s_ = -1;
}

Window Conditioner::push(const Bucket& bucket) {
  Window window;
  window.bucket = bucket;
  admit(bucket, window);
  update_lags(bucket, window);
  window.warm_s = static_cast<int>(history_.back().second - history_.front().second + 1);
  measure(window);
  return window;
}

// Keeps exactly the seconds that a full window needs; a hole that is too long empties it first.
void Conditioner::admit(const Bucket& bucket, Window& window) {
  if (!history_.empty()) {
    const std::int64_t step = bucket.second - history_.back().second;
    window.gap_s = static_cast<int>(std::clamp<std::int64_t>(step - 1, 0, 1'000'000'000));
    if (step <= 0 || window.gap_s > definition_.max_gap_s) history_.clear();
  }
  history_.push_back(bucket);
  while (history_.front().second <= bucket.second - history_s(definition_)) history_.pop_front();
}

// Means of what is there, for models that can live without a slope; the slope and "ready" need the full window.
void Conditioner::measure(Window& window) const {
  const std::int64_t last = window.bucket.second;
  Mean rate, temperature, uhfo;
  for (const Bucket& bucket : history_) {
    if (bucket.second <= last - definition_.length_s) continue;
    rate.add(bucket.rate_deg_per_h);
    temperature.add(bucket.temperature_degc);
    uhfo.add(bucket.uhfo_v);
  }
  window.rate_deg_per_h = rate.value();
  window.temperature_degc = temperature.value();
  window.uhfo_v = uhfo.value();
  if (window.warm_s < history_s(definition_)) return;
  window.slope_degc_per_s = slope(last);
  if (rate.count > 0 && std::isfinite(window.slope_degc_per_s)) window.state = WindowState::kReady;
}

double Conditioner::slope(std::int64_t last) const {
  const int length = definition_.length_s;
  if (definition_.slope == SlopeMethod::kLeastSquares) return least_squares_slope(history_, last, length);
  const double now = mean_temperature(history_, last, definition_.end_mean_s);
  const double before = mean_temperature(history_, last - length, definition_.end_mean_s);
  return (now - before) / length;
}

// One-pole mean of T per time constant. Short holes are bridged exactly (the pole decays by the true elapsed time); after
// an emptied window longer than a tenth of the shortest constant the past is unknown and the filters begin anew.
void Conditioner::update_lags(const Bucket& bucket, Window& window) {
  const auto& constants = definition_.lag_time_constants_s;
  if (constants.empty() || !std::isfinite(bucket.temperature_degc)) return;
  const std::int64_t step = bucket.second - last_lag_second_;
  const double shortest = *std::min_element(constants.begin(), constants.end());
  const double longest = *std::max_element(constants.begin(), constants.end());
  const double bridge_s = std::max<double>(definition_.max_gap_s + 1, shortest / 10);
  if (lag_age_s_ < 0 || step <= 0 || static_cast<double>(step) > bridge_s) {
    lag_mean_degc_.assign(constants.size(), bucket.temperature_degc);
    lag_age_s_ = 0;
  } else {
    lag_age_s_ += step;
    for (std::size_t i = 0; i < constants.size(); ++i) {
      const double keep = std::exp(-static_cast<double>(step) / constants[i]);
      lag_mean_degc_[i] = keep * lag_mean_degc_[i] + (1 - keep) * bucket.temperature_degc;
    }
  }
  last_lag_second_ = bucket.second;
  for (const double mean : lag_mean_degc_) window.lag_degc.push_back(bucket.temperature_degc - mean);
  window.lag_settling = static_cast<double>(lag_age_s_) < 3 * longest;
}

}  // namespace prism
