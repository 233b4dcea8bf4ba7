// SPDX-License-Identifier: MIT
// Gathers samples into buckets of one second, aligned to whole seconds of the samples' own time.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "compensation/sample.hpp"
#include "compensation/sensors.hpp"

namespace prism::compensation {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

/// The second (s, s + 1] that a sample time lies in: the time is the end of the sample's interval.
std::int64_t bucket_second(std::int64_t time_ns);

/// Means over one second of samples, of those that are believed. A quantity that no sample of the second carried is
/// kUnknown; of one of which none was believed, what was measured stands all the same.
struct Bucket {
  std::int64_t second = 0;  ///< whole seconds of the sample time: the bucket covers (second, second + 1] s
  std::uint32_t samples = 0;
  std::uint32_t missing_frames = 0;
  double rate_deg_per_h = kUnknown;  ///< weighted by each sample's interval
  double temperature_degc = kUnknown;
  double uhfo_v = kUnknown;
  std::uint32_t status = 0;  ///< all status bits seen in the second, or-ed
  bool partial = false;      ///< the session began or ended within this second: its means are of a part of it
  /// When its last sample had arrived, ns since 1970 UTC by the host's clock; 0: not known. The pipeline says it.
  std::int64_t arrival_ns = 0;
  QuantitySet implausible = {};      ///< of these samples were left out: they were implausible
  QuantitySet disbelieved = {};      ///< of these every sample was: the mean is of them
  SensorList sensor_list = {};       ///< null: none
  std::vector<double> sensors = {};  ///< as sensor_list
};

/// The bucket as windows take it: what is disbelieved is kUnknown.
Bucket believed(Bucket bucket);

/// push() takes samples in order of time and returns a bucket when a sample of a later second closes it; finish()
/// returns the one still open: the session ends. Seconds without samples give no bucket: the conditioner sees the gap.
/// The first bucket is partial where the interval of its first sample begins within the second; the last one where a
/// further sample would have belonged to it.
class Averager {
 public:
  explicit Averager(SensorList sensors = nullptr)
      : sensors_(sensors ? sensors->size() : 0), list_(std::move(sensors)) {}

  /// `implausible`: what of the sample is not believed. `sensors`: as the list; empty: not read with this sample.
  std::optional<Bucket> push(const Sample& sample, QuantitySet implausible = {}, std::span<const double> sensors = {});
  std::optional<Bucket> finish();

 private:
  struct WeightedSum {
    double sum = 0, weight = 0;
  };
  struct Mean {
    WeightedSum believed, doubted;
    bool any_doubted = false;
    void add(double value, double weight, bool implausible);
    double value() const;
    bool only_doubted() const { return any_doubted && !(believed.weight > 0); }
  };

  void open(const Sample& sample, std::int64_t second);
  void add(const Sample& sample, QuantitySet implausible);
  Bucket close() const;

  Bucket bucket_;
  Mean rate_, temperature_, uhfo_;
  std::vector<WeightedSum> sensors_;
  SensorList list_;
  std::int64_t last_ns_ = 0;    ///< of the last sample,
  double last_interval_s_ = 0;  ///< and how long it was
  std::int64_t begin_ns_ = 0;   ///< of the open bucket
  bool open_ = false, begun_ = false;
};

}  // namespace prism::compensation
