// SPDX-License-Identifier: MIT
#include "compensation/averager.hpp"

#include <cmath>

namespace prism::compensation {

// A sample at exactly 12:00:01.000 belongs to the second that ends there: ceil(time) - 1.
std::int64_t bucket_second(std::int64_t time_ns) {
  return time_ns / kNanosecondsPerSecond - (time_ns % kNanosecondsPerSecond > 0 ? 0 : 1);
}

std::optional<Bucket> Averager::push(const Sample& sample) {
  const std::int64_t second = bucket_second(sample.time_ns);
  std::optional<Bucket> closed;
  if (open_ && second != bucket_.second) closed = close();
  if (!open_ || closed) open(second);
  add(sample);
  return closed;
}

std::optional<Bucket> Averager::finish() {
  if (!open_) return std::nullopt;
  open_ = false;
  return close();
}

void Averager::open(std::int64_t second) {
  *this = Averager();
  bucket_.second = second;
  open_ = true;
}

void Averager::add(const Sample& sample) {
  ++bucket_.samples;
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
