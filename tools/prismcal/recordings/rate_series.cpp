// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/rate_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/outside_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/recordings/units.hpp"

namespace prism::recordings {
namespace {

/// Returns kUnknown for a gap: an empty field, or "nan" as other programs write it.
std::optional<double> number_or_gap(std::string_view field) {
  if (field.empty() || field == "nan" || field == "NaN") return kUnknown;
  return csv_number(field);
}

std::string unit_by_name(const std::string& column) {
  if (column.ends_with("_dps") || column.ends_with("_deg_per_s")) return "deg/s";
  if (column.ends_with("_rad_per_s") || column.ends_with("_rads")) return "rad/s";
  return "deg/h";
}

/// Sets the unit of the series and returns its factor to deg/h.
Result<double> set_unit(RateSeries& series, const RateSeriesChoice& choice) {
  series.unit = choice.unit.empty() ? unit_by_name(series.column) : choice.unit;
  if (const Unit* unit = find_unit("rate", series.unit)) return unit->factor;
  return make_error("--unit", fmt::format("found \"{}\", expected deg/h, deg/s, rad/s or arcsec/s", series.unit));
}

/// The columns to read.
struct Layout {
  std::vector<std::string> names;  ///< "1", "2", … if the file has no names
  bool named = false;
  std::size_t rate = 0;
  std::optional<std::size_t> time;
};

Result<Layout> choose_columns(std::vector<std::string> first_line, const RateSeriesChoice& choice,
                              const std::string& path) {
  Layout layout;
  layout.names = std::move(first_line);
  layout.named = std::any_of(layout.names.begin(), layout.names.end(),
                             [](const std::string& field) { return !number_or_gap(field); });
  for (std::size_t i = 0; !layout.named && i < layout.names.size(); ++i) layout.names[i] = std::to_string(i + 1);
  const std::string all = fmt::format("{}", fmt::join(layout.names, ", "));
  if (!choice.time_column.empty()) {
    layout.time = csv_column(layout.names, choice.time_column);
    if (!layout.time)
      return make_error(path, fmt::format("found no column \"{}\", expected one of {}", choice.time_column, all));
  } else if (layout.named) {
    for (const char* name : {"t_s", "time_s"}) {
      if (const auto found = csv_column(layout.names, name)) layout.time = found;
    }
  }
  auto rate = csv_column(layout.names, choice.column.empty() ? "rate_deg_per_h" : choice.column);
  if (!rate && choice.column.empty() && layout.names.size() == 1) rate = 0;
  if (!rate && choice.column.empty() && layout.names.size() == 2 && layout.time) rate = 1 - *layout.time;
  if (!rate) {
    return make_error(path, choice.column.empty()
                                ? fmt::format("found columns {}, expected --column NAME", all)
                                : fmt::format("found no column \"{}\", expected one of {}", choice.column, all));
  }
  layout.rate = *rate;
  return layout;
}

/// Rates and times in the units of the file.
struct Columns {
  Layout layout;
  std::vector<double> rates, times;

  Result<void> add(const CsvLines& lines) {
    const auto field = lines.field(layout.rate);
    const auto rate = field ? number_or_gap(*field) : std::nullopt;
    if (!rate) {
      return make_error(lines.position(), fmt::format("column {}: found \"{}\", expected a number",
                                                      layout.names[layout.rate], field.value_or("")));
    }
    rates.push_back(*rate);
    if (!layout.time) return {};
    const auto time = csv_number(lines.field(*layout.time).value_or(""));
    if (!time) return make_error(lines.position(), "found no time, expected seconds");
    if (!times.empty() && !(*time > times.back()))
      return make_error(lines.position(),
                        fmt::format("found time {} after {}, expected increasing times", *time, times.back()));
    times.push_back(*time);
    return {};
  }
};

Result<Columns> read_columns(const std::string& path, const RateSeriesChoice& choice) {
  auto opened = CsvLines::open(path);
  if (!opened) return tl::unexpected(opened.error());
  CsvLines& lines = *opened;
  Columns columns;
  if (!lines.next()) return make_error(path, "found no row of numbers, expected a rate in every line");
  for (const std::string& field : lines.fields()) {
    if (auto good = check_text(TextRule::kText, field, lines.position()); !good) return tl::unexpected(good.error());
  }
  auto layout = choose_columns(lines.fields(), choice, path);
  if (!layout) return tl::unexpected(layout.error());
  columns.layout = std::move(*layout);
  for (bool more = !columns.layout.named || lines.next(); more; more = lines.next()) {
    if (const auto done = columns.add(lines); !done) return tl::unexpected(done.error());
  }
  if (auto good = lines.finish(); !good) return tl::unexpected(good.error());
  if (columns.rates.empty()) return make_error(path, "found no row of numbers, expected a rate in every line");
  return columns;
}

double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  steps.reserve(times.size());
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return evaluation::median_of(std::move(steps));
}

// prismd's log has one row per second. Partial seconds, missing seconds and the time between sessions are gaps.
Result<RateSeries> read_log_series(const std::string& path, const RateSeriesChoice& choice) {
  RateSeries series;
  series.column = choice.column.empty() ? "rate_deg_per_h" : choice.column;
  const auto factor = set_unit(series, choice);
  if (!factor) return tl::unexpected(factor.error());
  const auto folder = LogFolder::read(path, choice.axis, series.column);
  if (!folder) return tl::unexpected(folder.error());
  const LogTable joined = join_rows(*folder);
  if (joined.rows.empty()) return make_error(path, "found no row of numbers, expected a rate in every line");
  std::size_t session = 0;
  for (std::size_t i = 0; i < joined.rows.size(); ++i) {
    const compensation::SecondMean& second_mean = joined.rows[i].second_mean;
    const bool begins = session < joined.sessions.size() && joined.sessions[session] == i;
    if (begins) ++session;
    const bool follows = i > 0 && !begins && second_mean.second == joined.rows[i - 1].second_mean.second + 1;
    if (i > 0 && !follows) series.rate_deg_per_h.push_back(kUnknown);
    const bool valid = !second_mean.partial && !second_mean.implausible.any() && !second_mean.clocks_differ;
    series.rate_deg_per_h.push_back(valid ? joined.rows[i].value * *factor : kUnknown);
  }
  series.rows = joined.rows.size();
  series.interval_source = "one row per second";
  series.notes = joined.left_out.lines();
  series.notes.insert(series.notes.end(), folder->deletions.begin(), folder->deletions.end());
  return series;
}

}  // namespace

Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice) {
  std::error_code error;
  const bool log = std::filesystem::is_directory(path, error) || is_log(path);
  if (log && choice.time_column.empty() && !choice.interval_s) return read_log_series(path, choice);
  const auto columns = read_columns(path, choice);
  if (!columns) return tl::unexpected(columns.error());
  const auto& [layout, rates, times] = *columns;
  RateSeries series;
  series.column = layout.names[layout.rate];
  const auto factor = set_unit(series, choice);
  if (!factor) return tl::unexpected(factor.error());
  series.rows = rates.size();

  const bool timed = times.size() > 1;
  series.interval_s = choice.interval_s ? *choice.interval_s : timed ? median_step(times) : 1;
  series.interval_source = choice.interval_s ? "given"
                           : timed           ? "median step of " + layout.names[*layout.time]
                                             : "assumed: the file has no time";
  if (!(series.interval_s > 0))
    return make_error(path, fmt::format("found interval {} s, expected more than 0", series.interval_s));
  series.rate_deg_per_h.reserve(series.rows);
  for (std::size_t i = 0; i < series.rows; ++i) {
    if (timed && i > 0 && times[i] - times[i - 1] > 1.5 * series.interval_s) series.rate_deg_per_h.push_back(kUnknown);
    series.rate_deg_per_h.push_back(rates[i] * *factor);
  }
  return series;
}

}  // namespace prism::recordings
