// SPDX-License-Identifier: MIT
#include "compensation/sensor_limits.hpp"

#include <fmt/format.h>

#include <vector>

namespace prism {
namespace {

bool same(const std::optional<Range>& a, const std::optional<Range>& b) {
  return a.has_value() == b.has_value() && (!a || (a->min == b->min && a->max == b->max));
}

}  // namespace

bool SensorStatement::operator==(const SensorStatement& other) const {
  return same(range, other.range) && greatest_slope_per_s == other.greatest_slope_per_s && stuck_s == other.stuck_s;
}

std::optional<Range> read_range(const Section& section, const char* key, Range allowed, double unit) {
  if (!section.has(key)) return std::nullopt;
  const std::vector<double> ends = section.numbers(key, allowed);
  if (!section.good()) return std::nullopt;
  if (ends.size() != 2 || !(ends[0] < ends[1])) {
    section.fail(key, fmt::format("found [{}], expected [low, high], low below high", fmt::join(ends, ", ")));
    return std::nullopt;
  }
  return Range{ends[0] * unit, ends[1] * unit};
}

std::optional<double> read_greatest_slope(const Section& section, const char* key) {
  if (!section.has(key)) return std::nullopt;
  return section.number(key, {1e-6, 1e6});
}

}  // namespace prism
