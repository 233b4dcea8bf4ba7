// SPDX-License-Identifier: MIT
// The rate of a recording at each second, in pieces: a long gap begins the next one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace prism::recordings {

/// Values of successive seconds; unknown ones are kUnknown, and are between known ones.
struct Series {
  std::int64_t start_s = 0;  ///< of the first value
  std::vector<double> values = {};

  std::int64_t second(std::size_t i) const { return start_s + static_cast<std::int64_t>(i); }
  std::int64_t end_s() const { return second(values.size()); }  ///< the second after the last one
};

/// Appends the value of a second after all that are there; unknown ones are left out. After this gap, or a longer one,
/// it begins a series: the time of a gap between two sessions is not known.
inline constexpr std::int64_t kLongGap_s = 60;
void append(std::vector<Series>& all, std::int64_t second, double value);

/// nullopt: it is not known.
std::optional<double> value_at(const std::vector<Series>& all, std::int64_t second);

/// All values, with evaluation::kAllanBreak between two series.
std::vector<double> joined(std::vector<Series> all);

/// Calls visit(second, value) for each known value in order.
template <class Visit>
void for_each_known(const std::vector<Series>& all, Visit&& visit) {
  for (const Series& series : all) {
    for (std::size_t i = 0; i < series.values.size(); ++i)
      if (series.values[i] == series.values[i]) visit(series.second(i), series.values[i]);
  }
}

}  // namespace prism::recordings
