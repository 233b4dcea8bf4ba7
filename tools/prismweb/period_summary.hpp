// SPDX-License-Identifier: MIT
// What long views are made of: of each quantity the least and the greatest value of a period.
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

/// Of the seconds in which a quantity was known.
struct KnownMean {
  double sum = 0;
  std::uint32_t known = 0;  ///< seconds

  void take(double value) {
    if (std::isnan(value)) return;
    sum += value;
    ++known;
  }
  /// NaN: known in none.
  double value() const { return known > 0 ? sum / known : std::numeric_limits<double>::quiet_NaN(); }
};
inline constexpr std::size_t kMeans = 2;  ///< kRate and kCorrected have one

/// A second, or several of them joined. NaN: the quantity was known in none of them.
struct PeriodSummary {
  std::int64_t begin_s = 0;  ///< of the data's time; a row of the log with time_s = t begins at t − 1
  std::array<double, kQuantities> min = unknown(), max = unknown();
  std::array<KnownMean, kMeans> mean{};
  std::uint32_t samples = 0, missing = 0;
  std::uint32_t seconds = 0, good = 0;  ///< rows, and those of quality "good"

  static std::array<double, kQuantities> unknown() {
    std::array<double, kQuantities> none{};
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
  }
  /// Joins another period to this one, which keeps its begin.
  void add(const PeriodSummary& other);
};

/// The values of a period in the order of these columns, which `range` (docs/page.md) and the store have.
inline constexpr std::array<const char*, 21> kPeriodColumns = {
    "rate_min", "rate_max",        "corrected_min",   "corrected_max", "bias_min",  "bias_max",
    "sd_max",   "temperature_min", "temperature_max", "slope_min",     "slope_max", "uhfo_min",
    "uhfo_max", "rate_mean",       "corrected_mean",  "samples",       "missing",   "seconds",
    "good",     "rate_known",      "corrected_known"};
inline constexpr std::size_t kFirstCount = 15;    ///< from there on they are integers
inline constexpr std::size_t kRangeColumns = 19;  ///< of `range`: all but in how many seconds a mean is known
using PeriodValues = std::array<double, kPeriodColumns.size()>;
PeriodValues values_of(const PeriodSummary& period);
/// The period with these values; the least sd, which is not among them, is the greatest.
PeriodSummary period_of(std::int64_t begin_s, const PeriodValues& values);

/// Of a row of the log.
PeriodSummary second_of(const compensation::CompensatedWindow& row);
/// Of the params of a window notification, which has means of T and U over the window; nothing where it is none.
std::optional<PeriodSummary> second_of(const nlohmann::json& window);

/// The begin of the period of `length_s` that `time_s` is in.
std::int64_t floor_to(std::int64_t time_s, std::int64_t length_s);

/// The shortest step, of those that docs/page.md has, that gives at most `points` for `length_s` and is not below
/// `least_s`. Beyond the longest, whole days.
std::int64_t step_for(double length_s, int points, std::int64_t least_s);

/// The periods whose begin is within [from_s, to_s), joined by steps, in the order of time. Nothing is left out.
std::vector<PeriodSummary> downsample(std::span<const PeriodSummary> periods, std::int64_t from_s, std::int64_t to_s,
                                      std::int64_t step_s);

}  // namespace prism::prismweb
