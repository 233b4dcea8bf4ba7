// SPDX-License-Identifier: MIT
#include "compensation/averager.hpp"

#include <algorithm>
#include <cmath>

namespace prism::compensation {
namespace {

// Bounded: an interval of an hour or more leaves no second whole anyway.
std::int64_t interval_of(const Sample& sample) {
  return sample.interval_s > 0 ? std::llround(1e9 * std::min(sample.interval_s, 3600.0)) : 0;
}

}  // namespace

// A sample at exactly 12:00:01.000 belongs to the second that ends there: ceil(time) - 1.
std::int64_t bucket_second(std::int64_t time_ns) {
  return time_ns / kNanosecondsPerSecond - (time_ns % kNanosecondsPerSecond > 0 ? 0 : 1);
}

std::optional<Bucket> Averager::push(const Sample& sample) {
  const std::int64_t second = bucket_second(sample.time_ns);
  std::optional<Bucket> closed;
  if (open_ && second != bucket_.second) closed = close();
  if (!open_ || closed) open(sample, second);
  add(sample);
  return closed;
}

std::optional<Bucket> Averager::finish() {
  if (!open_) return std::nullopt;
  if (next_end_ns_ <= (bucket_.second + 1) * kNanosecondsPerSecond) bucket_.partial = true;
  const Bucket last = close();
  *this = Averager();
  return last;
}

void Averager::open(const Sample& sample, std::int64_t second) {
  const bool begun = begun_;
  *this = Averager();
  open_ = begun_ = true;
  bucket_.second = second;
  const std::int64_t interval_ns = interval_of(sample);
  const std::int64_t missed_ns = sample.time_ns - interval_ns - second * kNanosecondsPerSecond;
  bucket_.partial = !begun && missed_ns > interval_ns / 100;  // stamps are that true, not truer
}

void Averager::add(const Sample& sample) {
  ++bucket_.samples;
  next_end_ns_ = sample.time_ns + interval_of(sample);
  bucket_.missing_frames += sample.missing_frames;
  bucket_.status |= sample.status;
  if (std::isfinite(sample.rate_deg_per_h)) {
    angle_arcsec_ += sample.rate_deg_per_h * sample.interval_s;
    rate_time_s_ += sample.interval_s;
  }
  if (std::isfinite(sample.temperature_degc)) {
    temperature_sum_ += sample.temperature_degc;
    ++temperatures_;
  }
  if (std::isfinite(sample.uhfo_v)) {
    uhfo_sum_ += sample.uhfo_v;
    ++uhfos_;
  }
}

Bucket Averager::close() const {
  Bucket closed = bucket_;
  if (rate_time_s_ > 0) closed.rate_deg_per_h = angle_arcsec_ / rate_time_s_;
  if (temperatures_ > 0) closed.temperature_degc = temperature_sum_ / temperatures_;
  if (uhfos_ > 0) closed.uhfo_v = uhfo_sum_ / uhfos_;
  return closed;
}

}  // namespace prism::compensation
