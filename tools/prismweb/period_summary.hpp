// SPDX-License-Identifier: MIT
// Minimum, maximum and mean of each quantity in a period, for long views.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "compensation/compensated.hpp"

namespace prism::prismweb {

/// deg/h: rate, corrected, bias, sd; degC; degC/s; V.
enum Quantity : std::size_t { kRate, kCorrected, kBias, kSd, kTemperature, kSlope, kUhfo, kQuantities };

/// Mean over the seconds with a known value.
struct KnownMean {
  double sum = 0;
  std::uint32_t known = 0;  ///< seconds

  void take(double value) {
    if (std::isnan(value)) return;
    sum += value;
    ++known;
  }
  /// NaN without a known value.
  double value() const { return known > 0 ? sum / known : std::numeric_limits<double>::quiet_NaN(); }
};
inline constexpr std::size_t kMeans = 2;  ///< of kRate and kCorrected

/// Summary of one or more seconds. NaN: without a known value.
struct PeriodSummary {
  std::int64_t begin_s = 0;  ///< data time; the log row with time_s = t begins at t − 1
  std::array<double, kQuantities> min = unknown(), max = unknown();
  std::array<KnownMean, kMeans> mean{};
  std::uint32_t samples = 0, missing = 0;
  std::uint32_t seconds = 0, good = 0;  ///< rows, rows of quality "good"

  static std::array<double, kQuantities> unknown() {
    std::array<double, kQuantities> none{};
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
  }
  /// Adds another period. begin_s does not change.
  void add(const PeriodSummary& other);
};

/// Columns of the store and of `range` (docs/protocol.md).
inline constexpr std::array<const char*, 21> kPeriodColumns = {
    "rate_min", "rate_max",        "corrected_min",   "corrected_max", "bias_min",  "bias_max",
    "sd_max",   "temperature_min", "temperature_max", "slope_min",     "slope_max", "uhfo_min",
    "uhfo_max", "rate_mean",       "corrected_mean",  "samples",       "missing",   "seconds",
    "good",     "rate_known",      "corrected_known"};
inline constexpr std::size_t kFirstCount = 15;    ///< index of the first integer column
inline constexpr std::size_t kRangeColumns = 19;  ///< of `range`: without *_known
using PeriodValues = std::array<double, kPeriodColumns.size()>;
PeriodValues values_of(const PeriodSummary& period);
/// The reverse of values_of(). There is no column for the minimum sd; it is set to the maximum.
PeriodSummary period_of(std::int64_t begin_s, const PeriodValues& values);

/// Converts a row of the log.
PeriodSummary second_of(const compensation::CompensatedWindow& row);
/// Converts the params of a window notification. Returns nullopt if they have no valid time_s.
std::optional<PeriodSummary> second_of(const nlohmann::json& window);

/// Rounds down to a multiple of `length_s`.
std::int64_t floor_to(std::int64_t time_s, std::int64_t length_s);

/// Returns the shortest step of the list in docs/protocol.md that is at least `min_s` and gives at most `points` steps
/// in `length_s`. If the longest is too short, returns a number of days.
std::int64_t step_for(double length_s, int points, std::int64_t min_s);

/// Joins the periods that begin within [from_s, to_s) to steps, in order of time.
std::vector<PeriodSummary> downsample(std::span<const PeriodSummary> periods, std::int64_t from_s, std::int64_t to_s,
                                      std::int64_t step_s);

}  // namespace prism::prismweb
