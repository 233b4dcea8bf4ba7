// SPDX-License-Identifier: MIT
#include "tools/prismcal/series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/allan.hpp"
#include "compensation/sample.hpp"

namespace prism::recordings {

void append(std::vector<Series>& all, std::int64_t second, double value) {
  if (!std::isfinite(value)) return;
  if (all.empty() || second - all.back().end_s() >= kLongGap_s) all.push_back({second});
  std::vector<double>& values = all.back().values;
  values.resize(static_cast<std::size_t>(second - all.back().start_s), kUnknown);
  values.push_back(value);
}

std::optional<double> value_at(const std::vector<Series>& all, std::int64_t second) {
  const auto at = std::upper_bound(all.begin(), all.end(), second,
                                   [](std::int64_t wanted, const Series& series) { return wanted < series.end_s(); });
  if (at == all.end() || second < at->start_s) return std::nullopt;
  const double value = at->values[static_cast<std::size_t>(second - at->start_s)];
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::vector<double> joined(std::vector<Series> all) {
  if (all.size() == 1) return std::move(all.front().values);
  std::vector<double> values;
  for (Series& series : all) {
    const std::vector<double> more = std::move(series.values);  // a year has 250 MB
    if (!values.empty()) values.push_back(evaluation::kAllanBreak);
    values.insert(values.end(), more.begin(), more.end());
  }
  return values;
}

namespace {

using Stamps = std::vector<std::int64_t>;

/// The median of the spans over `rows` steps, per step.
double median_step_ns(const Stamps& stamps, std::size_t rows) {
  Stamps spans;
  for (std::size_t i = rows; i < stamps.size(); ++i) spans.push_back(stamps[i] - stamps[i - rows]);
  const auto middle = spans.begin() + static_cast<std::ptrdiff_t>(spans.size() / 2);
  std::nth_element(spans.begin(), middle, spans.end());
  return static_cast<double>(*middle) / static_cast<double>(rows);
}

/// The mean of the steps between stamps, without holes. A late stamp also makes a long step, but the next step is then
/// shorter: a step is a hole only if it stays too long together with each of its neighbours.
double first_interval_ns(const Stamps& stamps, double usual_ns) {
  const auto is_long = [&](std::size_t begin, std::size_t end) {
    return static_cast<double>(stamps[end] - stamps[begin]) > (static_cast<double>(end - begin) + 0.5) * usual_ns;
  };
  double sum = 0, count = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const bool is_hole =
        is_long(i - 1, i) && (i < 2 || is_long(i - 2, i)) && (i + 1 == stamps.size() || is_long(i - 1, i + 1));
    if (!is_hole) sum += static_cast<double>(stamps[i] - stamps[i - 1]), ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// The stamps on a grid with this interval.
struct Places {
  std::vector<SampleHole> holes;
  double jitter_ns = 0;
  double interval_ns = 0;      ///< the mean between the holes
  std::size_t shared_row = 0;  ///< the first row whose place is that of the row before; 0: none

  bool better_than(const Places& other) const {
    if (shared_row > 0 || other.shared_row > 0) return shared_row == 0 && other.shared_row > 0;
    return jitter_ns / interval_ns < other.jitter_ns / other.interval_ns;
  }
};

Places places_of(const Stamps& stamps, double interval_ns) {
  constexpr double kFollow = 1.0 / 8;  // of a stamp's distance: drift moves the grid, jitter does not
  Places places;
  if (!(interval_ns > 0)) places.shared_row = 1;
  double late_ns = 0;  // of the grid against the stamp of the row before
  double span_ns = 0;
  std::size_t count = 0;
  for (std::size_t i = 1; i < stamps.size() && places.shared_row == 0; ++i) {
    const auto step_ns = static_cast<double>(stamps[i] - stamps[i - 1]);
    const double steps = std::round((step_ns - late_ns) / interval_ns);
    if (steps < 1) places.shared_row = i;
    if (steps > 1) places.holes.push_back({i, static_cast<std::size_t>(steps) - 1});
    if (steps != 1) {
      late_ns = 0;
      continue;
    }
    const double off_ns = step_ns - late_ns - interval_ns;
    places.jitter_ns = std::max(places.jitter_ns, std::fabs(off_ns));
    late_ns = (kFollow - 1) * off_ns;
    span_ns += step_ns;
    ++count;
  }
  places.interval_ns = count > 0 ? span_ns / static_cast<double>(count) : interval_ns;
  return places;
}

/// A median of one step is right if many samples are lost, one of 16 if stamps alternate or are rounded.
Places best_places(const Stamps& stamps) {
  Places best;
  for (const std::size_t rows : {std::size_t{1}, std::min<std::size_t>(16, 1 + stamps.size() / 8)}) {
    Places places = places_of(stamps, first_interval_ns(stamps, median_step_ns(stamps, rows)));
    if (places.shared_row == 0) places = places_of(stamps, places.interval_ns);
    if (rows == 1 || places.better_than(best)) best = std::move(places);
  }
  return best;
}

/// The interval if no sample was lost, in ns: short jumps of one length at even distances, as rounding and jitter with
/// a pattern make them; 0: they are not.
double interval_without_loss_ns(const Places& places, std::size_t rows) {
  constexpr std::size_t kFewest = 3;  // one or two jumps always fit
  constexpr std::size_t kLongest = 4;
  constexpr double kDiffers = 0.005;  // of the interval: 0.25 % of an angle random walk
  std::size_t least = rows, most = 0, lost = 0, length = 0;
  std::optional<std::size_t> before;
  for (const SampleHole& hole : places.holes) {
    const bool is_jump = hole.lost <= kLongest && (length == 0 || hole.lost == length);
    if (is_jump) lost += hole.lost, length = hole.lost;
    if (is_jump && before) least = std::min(least, hole.row - *before), most = std::max(most, hole.row - *before);
    before = is_jump ? std::optional(hole.row) : std::nullopt;
  }
  const double share = static_cast<double>(lost) / static_cast<double>(rows);
  const bool even = length > 0 && lost >= kFewest * length && most <= least + 1;
  return even && share > kDiffers ? places.interval_ns * (1 + share) : 0;
}

std::vector<SampleHole> stated_holes(const Stamps& stamps, double interval_s) {
  std::vector<SampleHole> holes;
  StatedTimes times(interval_s);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    times.push(stamps[i]);
    if (times.lost() > 0) holes.push_back({i, times.lost()});
  }
  return holes;
}

}  // namespace

Result<SampleGrid> sample_grid(const Stamps& stamps, const std::string& where, double interval_s) {
  if (stamps.size() < 2)
    return make_error(where, fmt::format("found {}, expected 2 or more", counted(stamps.size(), "time")));
  if (stamps.back() == stamps.front()) return make_error(where, "found the same time in all rows");
  const double median_s = median_step_ns(stamps, 1) / 1e9;
  Places places = interval_s > 0 ? places_of(stamps, interval_s * 1e9) : best_places(stamps);
  if (const std::size_t row = places.shared_row; row > 0 && interval_s == 0) {
    const auto step_s = static_cast<double>(stamps[row] - stamps[row - 1]) / 1e9;
    const std::string found =
        step_s == 0 ? "has the time of the row before"
                    : fmt::format("is {:.6g} s after the row before, but the usual step is {:.6g} s", step_s, median_s);
    return make_error(where, fmt::format("row {} {}: times repeat, come in batches or jitter; state the true step with "
                                         "--interval SECONDS",
                                         row + 1, found));
  }
  if (const double other_ns = interval_s > 0 ? 0 : interval_without_loss_ns(places, stamps.size()); other_ns > 0)
    return make_error(where,
                      fmt::format("two readings are possible: a row every {:.6g} s, and {} at even "
                                  "distances, or every {:.6g} s with rounded times; state --interval",
                                  places.interval_ns / 1e9, counted(places.holes.size(), "hole"), other_ns / 1e9));
  SampleGrid grid;
  grid.interval_s = interval_s > 0 ? interval_s : places.interval_ns / 1e9;
  grid.holes = places.shared_row > 0 ? stated_holes(stamps, interval_s) : std::move(places.holes);
  for (const SampleHole& hole : grid.holes) grid.lost += hole.lost;
  if (places.shared_row > 0 || places.jitter_ns > 1e7 * grid.interval_s)
    grid.notes.push_back(
        fmt::format("time: mean step {:.6g} s, median step {:.6g} s; used: {:.6g} s, count over span{}",
                    mean_step_s(stamps), median_s, grid.interval_s, grid.holes.empty() ? "" : " between holes"));
  if (grid.lost > 0)
    grid.notes.push_back(
        fmt::format("{} lost in {}{}", counted(grid.lost, "sample"), counted(grid.holes.size(), "hole"),
                    grid.lost > stamps.size() ? ", more than there are rows: are there two recordings?" : ""));
  return grid;
}

std::string step_advice(double interval_s) {
  const double step_s = std::ceil(interval_s);
  return fmt::format("a row every {:.6g} s needs --max-gap {:.0f} --end-mean {:.0f} --window {:.0f}", interval_s,
                     step_s, std::max(10.0, step_s), std::max(100.0, 10 * step_s));
}

double mean_step_s(const Stamps& stamps) {
  if (stamps.size() < 2 || stamps.back() <= stamps.front()) return 1;
  return static_cast<double>(stamps.back() - stamps.front()) / static_cast<double>(stamps.size() - 1) / 1e9;
}

std::int64_t StatedTimes::push(std::int64_t stamp_ns) {
  constexpr double kHole = 2.5;
  const std::int64_t step_ns = rows_ > 0 ? stamp_ns - last_stamp_ns_ : 0;
  const double usual_ns = std::max(interval_ns_, static_cast<double>(usual_step_ns_));
  last_stamp_ns_ = stamp_ns;
  lost_ = 0;
  if (usual_step_ns_ > 0 && static_cast<double>(step_ns) > kHole * usual_ns) {
    lost_ =
        static_cast<std::size_t>(std::max(1.0, std::round((static_cast<double>(step_ns) - usual_ns) / interval_ns_)));
    rows_ = 0;
  } else if (step_ns > 0) {
    usual_step_ns_ = step_ns;
  }
  if (rows_ == 0) begin_ns_ = stamp_ns;
  return begin_ns_ + std::llround(interval_ns_ * static_cast<double>(rows_++));
}

}  // namespace prism::recordings
