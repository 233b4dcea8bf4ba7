// SPDX-License-Identifier: MIT
#include "compensation/second_averager.hpp"

#include <algorithm>
#include <cmath>

namespace prism::compensation {
namespace {

// Limited: with an interval of an hour or more no second is complete.
std::int64_t interval_ns(double interval_s) {
  return interval_s > 0 ? std::llround(1e9 * std::min(interval_s, 3600.0)) : 0;
}

}  // namespace

// A sample at exactly 12:00:01.000 belongs to the second that ends there: ceil(time) - 1.
std::int64_t second_number(std::int64_t time_ns) {
  return time_ns / kNanosecondsPerSecond - (time_ns % kNanosecondsPerSecond > 0 ? 0 : 1);
}

SecondMean without_implausible(SecondMean second_mean) {
  if (second_mean.all_implausible.rate) second_mean.rate_deg_per_h = kUnknown;
  if (second_mean.all_implausible.temperature) second_mean.temperature_degc = kUnknown;
  if (second_mean.all_implausible.uhfo) second_mean.uhfo_v = kUnknown;
  if (second_mean.clocks_differ)
    second_mean.rate_deg_per_h = second_mean.temperature_degc = second_mean.uhfo_v = kUnknown;
  return second_mean;
}

void SecondAverager::Mean::add(double value, double weight, bool is_implausible) {
  any_implausible = any_implausible || is_implausible;
  if (!std::isfinite(value)) return;
  ++known;
  WeightedSum& to = is_implausible ? implausible : plausible;
  to.sum += value * weight;
  to.weight += weight;
}

double SecondAverager::Mean::value() const {
  if (plausible.weight > 0) return plausible.sum / plausible.weight;
  return implausible.weight > 0 ? implausible.sum / implausible.weight : kUnknown;
}

std::optional<SecondMean> SecondAverager::push(const Sample& sample, QuantitySet implausible,
                                               std::span<const double> sensors) {
  const auto take = [&] {
    add(sample, implausible);
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (!std::isfinite(sensors[i])) continue;
      sensors_[i].sum += sensors[i];
      sensors_[i].weight += 1;
    }
  };
  const std::int64_t into_ns = sample.time_ns - begin_ns_;
  if (open_ && into_ns > 0 && into_ns <= kNanosecondsPerSecond) {  // the usual case: avoids constructing a mean
    take();
    return std::nullopt;
  }
  std::optional<SecondMean> closed;
  if (open_) closed = close();
  open(sample, second_number(sample.time_ns));
  take();
  return closed;
}

std::optional<SecondMean> SecondAverager::finish() {
  if (!open_) return std::nullopt;
  const std::int64_t next_end_ns = last_ns_ + interval_ns(last_interval_s_);  // when the next sample would be due
  if (next_end_ns <= begin_ns_ + kNanosecondsPerSecond) second_mean_.partial = true;
  const SecondMean last = close();
  *this = SecondAverager(list_);
  return last;
}

void SecondAverager::open(const Sample& sample, std::int64_t second) {
  const bool begun = begun_;
  second_mean_ = {};
  rate_ = temperature_ = uhfo_ = {};
  std::fill(sensors_.begin(), sensors_.end(), WeightedSum{});
  open_ = begun_ = true;
  second_mean_.second = second;
  begin_ns_ = second * kNanosecondsPerSecond;
  const std::int64_t length_ns = interval_ns(sample.interval_s);
  const std::int64_t missed_ns = sample.time_ns - length_ns - begin_ns_;
  // Tolerance: time stamps are accurate to about 1 % of an interval.
  second_mean_.partial = !begun && missed_ns > length_ns / 100;
}

void SecondAverager::add(const Sample& sample, QuantitySet implausible) {
  ++second_mean_.samples;
  last_ns_ = sample.time_ns;
  last_interval_s_ = sample.interval_s;
  second_mean_.missing_frames += sample.missing_frames;
  second_mean_.status |= sample.status;
  second_mean_.clocks_differ |= sample.clocks_differ;
  rate_.add(sample.rate_deg_per_h, sample.interval_s, implausible.rate);
  temperature_.add(sample.temperature_degc, 1, implausible.temperature);
  uhfo_.add(sample.uhfo_v, 1, implausible.uhfo);
}

SecondMean SecondAverager::close() const {
  SecondMean closed = second_mean_;
  // A few valid samples do not stand for a second.
  if (2 * std::uint64_t{rate_.known} >= closed.samples) closed.rate_deg_per_h = rate_.value();
  closed.temperature_degc = temperature_.value();
  closed.uhfo_v = uhfo_.value();
  closed.sensor_list = list_;
  for (const WeightedSum& sensor : sensors_)
    closed.sensors.push_back(sensor.weight > 0 ? sensor.sum / sensor.weight : kUnknown);
  closed.implausible = {rate_.any_implausible, temperature_.any_implausible, uhfo_.any_implausible};
  closed.all_implausible = {rate_.all_implausible(), temperature_.all_implausible(), uhfo_.all_implausible()};
  return closed;
}

}  // namespace prism::compensation
