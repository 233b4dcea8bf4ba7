// SPDX-License-Identifier: MIT
// Gathers samples into buckets of one second, aligned to whole seconds of the samples' own time.
#pragma once

#include <cstdint>
#include <optional>

#include "compensation/sample.hpp"

namespace prism::compensation {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

/// The second (s, s + 1] that a sample time lies in: the time is the end of the sample's interval.
std::int64_t bucket_second(std::int64_t time_ns);

/// Means over one second of samples. A quantity that no sample of the second carried is kUnknown.
struct Bucket {
  std::int64_t second = 0;  ///< whole seconds of the sample time: the bucket covers (second, second + 1] s
  std::uint32_t samples = 0;
  std::uint32_t missing_frames = 0;
  double rate_deg_per_h = kUnknown;  ///< weighted by each sample's interval
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;
  std::uint32_t status = 0;  ///< all status bits seen in the second, or-ed
  bool partial = false;      ///< the session began or ended within this second: its means are of a part of it
};

/// push() takes samples in order of time and returns a bucket when a sample of a later second closes it; finish()
/// returns the one still open: the session ends. Seconds without samples give no bucket: the conditioner sees the gap.
/// The first bucket is partial where the interval of its first sample begins within the second; the last one where a
/// further sample would have belonged to it.
class Averager {
 public:
  std::optional<Bucket> push(const Sample& sample);
  std::optional<Bucket> finish();

 private:
  void open(const Sample& sample, std::int64_t second);
  void add(const Sample& sample);
  Bucket close() const;

  Bucket bucket_;
  double angle_arcsec_ = 0, rate_time_s_ = 0;
  double temperature_sum_ = 0, uhfo_sum_ = 0;
  std::uint32_t temperatures_ = 0, uhfos_ = 0;
  std::int64_t next_end_ns_ = 0;  ///< when the sample after the last one is due
  bool open_ = false, begun_ = false;
};

}  // namespace prism::compensation
