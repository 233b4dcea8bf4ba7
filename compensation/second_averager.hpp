// SPDX-License-Identifier: MIT
// Averages samples over one second, aligned to integer seconds of the sample time.
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

/// Returns s of the second (s, s + 1] that contains time_ns, the end of a sample's interval.
std::int64_t second_number(std::int64_t time_ns);

/// Means over the plausible values of one second. A quantity is kUnknown if no sample contained it. For one without a
/// plausible value see `all_implausible`.
struct SecondMean {
  std::int64_t second = 0;    ///< integer seconds of the sample time: covers (second, second + 1] s
  std::uint32_t samples = 0;  ///< all, also those with unknown or implausible values
  std::uint32_t missing_frames = 0;
  double rate_deg_per_h = kUnknown;    ///< weighted by each sample's interval; kUnknown if most samples have none
  double temperature_degc = kUnknown;  ///< unweighted, as uhfo_v and sensors
  double uhfo_v = kUnknown;
  std::uint32_t status = 0;  ///< all status bits seen in the second, or-ed
  bool partial = false;      ///< the session began or ended within this second: the means cover a part of it
  /// Arrival time of the last sample, ns since 1970 UTC by the host clock; 0: unknown. Set by the pipeline.
  std::int64_t arrival_ns = 0;
  QuantitySet implausible = {};  ///< at least one value was implausible; left out unless all_implausible
  /// At least one value was implausible and none was plausible: the mean is over the implausible ones; kUnknown if they
  /// were outside their field (Sample::out_of_bounds) or infinite.
  QuantitySet all_implausible = {};
  SensorList sensor_list = {};       ///< null: no sensors
  std::vector<double> sensors = {};  ///< in the order of sensor_list
  bool clocks_differ = false;        ///< of a sample of the second (Sample::clocks_differ)
};

/// Returns the mean with each quantity of all_implausible set to kUnknown, for windows; all, if clocks_differ.
SecondMean without_implausible(SecondMean second_mean);

/// push() takes samples in order of time and returns a mean when a sample of another second arrives: a later one, or an
/// earlier one after the clock was set back. finish() ends the session and returns the open second, nullopt without
/// samples; then the averager is as new. Seconds without samples return no mean: the feature extraction detects the
/// gap. The first mean is partial if the interval of its first sample begins after the start of the second, by more
/// than 1 % of the interval; the last one if the next sample would still end within it.
class SecondAverager {
 public:
  explicit SecondAverager(SensorList sensors = nullptr)
      : sensors_(sensors ? sensors->size() : 0), list_(std::move(sensors)) {}

  /// `sample.interval_s` must be > 0. `implausible`: quantities of the sample to leave out. `sensors`: in the order of
  /// the list, and as long; empty: not read with this sample.
  std::optional<SecondMean> push(const Sample& sample, QuantitySet implausible = {},
                                 std::span<const double> sensors = {});
  std::optional<SecondMean> finish();

 private:
  struct WeightedSum {
    double sum = 0, weight = 0;
  };
  struct Mean {
    WeightedSum plausible, implausible;
    bool any_implausible = false;
    std::uint32_t known = 0;  ///< samples with a value
    void add(double value, double weight, bool is_implausible);
    double value() const;
    bool all_implausible() const { return any_implausible && !(plausible.weight > 0); }
  };

  void open(const Sample& sample, std::int64_t second);
  void add(const Sample& sample, QuantitySet implausible);
  SecondMean close() const;

  SecondMean second_mean_;
  Mean rate_, temperature_, uhfo_;
  std::vector<WeightedSum> sensors_;
  SensorList list_;
  std::int64_t last_ns_ = 0;    ///< time of the last sample
  double last_interval_s_ = 0;  ///< its interval
  std::int64_t begin_ns_ = 0;   ///< start of the open second
  bool open_ = false, begun_ = false;
};

}  // namespace prism::compensation
