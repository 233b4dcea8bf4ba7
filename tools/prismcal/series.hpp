// SPDX-License-Identifier: MIT
// The rate of a recording at each second, in pieces: a long gap begins the next one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

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

struct SampleHole {
  std::size_t row = 0;   ///< first row after the hole, from 0
  std::size_t lost = 0;  ///< samples
};

struct SampleGrid {
  double interval_s = 0;
  std::vector<SampleHole> holes;   ///< in order of rows
  std::size_t lost = 0;            ///< in all holes
  std::vector<std::string> notes;  ///< remarks on stamps more than 1 % of the interval from the grid, and lost samples
};

/// The interval is the span of the rows between holes by their count. Each stamp must be nearest to a place of its own
/// on a grid that follows a slow drift; a place without a stamp is a lost sample. So stamps may be rounded or jitter by
/// less than half an interval. `interval_s`: > 0: the true one; then any stamps are accepted, and if they
/// are not on a grid, a step of more than 2.5 usual ones is a hole. Errors: fewer than two stamps; stamps that are not
/// on a grid; single jumps at even distances, which are lost samples or rounded stamps. Stamps do not decrease.
Result<SampleGrid> sample_grid(const std::vector<std::int64_t>& stamps_ns, const std::string& where,
                               double interval_s = 0);

/// The mean step of stamps; 1 if there are too few, or no time passes.
double mean_step_s(const std::vector<std::int64_t>& stamps_ns);

/// "a row every 10 s needs --max-gap 10 --end-mean 10 --window 100".
std::string step_advice(double interval_s);

/// The times of rows whose interval is known: of the stamps only holes are used.
class StatedTimes {
 public:
  explicit StatedTimes(double interval_s) : interval_ns_(interval_s * 1e9) {}
  /// The time of the next row.
  std::int64_t push(std::int64_t stamp_ns);
  std::size_t lost() const { return lost_; }  ///< samples before the last row

 private:
  double interval_ns_;
  std::int64_t begin_ns_ = 0, last_stamp_ns_ = 0, usual_step_ns_ = 0;
  std::size_t rows_ = 0, lost_ = 0;  ///< rows_: since begin_ns_
};

}  // namespace prism::recordings
