// SPDX-License-Identifier: MIT
// One column of a log or table as an evenly spaced rate.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "compensation/evaluation/allan.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/series.hpp"

namespace prism::recordings {
namespace {

constexpr std::string_view kRateUnits = "deg/h, deg/s, rad/s or arcsec/s";

/// The factor to deg/h. Errors: no unit; one of another quantity.
Result<double> factor_of(const RateSeriesChoice& choice, const tables::Header& header) {
  const bool stated = !choice.unit.empty();
  if (!stated && !header.unit)
    return make_error("--unit", fmt::format("found none, and no unit in the header of column {}, expected {}",
                                            header.text.empty() ? "1" : header.text, kRateUnits));
  if (!stated && header.unit->quantity != "rate")
    return make_error("--column", fmt::format("found \"{}\" in {}, expected a rate; --unit states another unit",
                                              header.text, header.unit->name));
  const tables::Unit* const unit = stated ? tables::find_unit("rate", choice.unit) : header.unit;
  if (unit) return unit->factor;
  return make_error("--unit", fmt::format("found \"{}\", expected {}", choice.unit, kRateUnits));
}

/// The rate column and the time column of a table.
Result<tables::Selection> choose_columns(const tables::PlainTable& table, const RateSeriesChoice& choice) {
  tables::Selection chosen;
  const auto& columns = table.columns();
  if (!choice.time_column.empty()) {
    const auto found = table.find(choice.time_column);
    if (!found) return tl::unexpected<Error>(found.error());
    chosen.time = tables::TimeSelection{*found};
  } else if (const auto time = columns.size() > 1 ? table.time_column() : std::nullopt) {
    const bool readable = table.kind(*time) != tables::ColumnKind::kText;
    if (readable || choice.table.interval_s == 0) chosen.time = tables::TimeSelection{*time};
  }
  const std::size_t others = columns.size() - (chosen.time ? 1 : 0);
  const bool named = std::ranges::any_of(columns, [](const auto& column) { return column.text == "rate_deg_per_h"; });
  if (!choice.column.empty() || named) {
    const auto found = table.find(choice.column.empty() ? "rate_deg_per_h" : choice.column);
    if (!found) return tl::unexpected<Error>(found.error());
    chosen.numbers = {*found};
  } else if (others == 1) {
    chosen.numbers = {chosen.time && chosen.time->column == 0 ? std::size_t{1} : 0};
  } else {
    return make_error(table.path(), fmt::format("found columns {}, expected --column NAME", table.names_text()));
  }
  return chosen;
}

/// Rates in the unit of the file, and times.
struct Columns {
  std::vector<double> rates;
  std::vector<std::int64_t> times_ns;
  std::vector<bool> only_others;  ///< of each row; empty without a time
};

Result<Columns> read_columns(tables::PlainTable& table, const tables::Selection& selection) {
  if (auto good = table.select(selection); !good) return tl::unexpected<Error>(good.error());
  Columns columns;
  tables::Row row;
  while (true) {
    const auto more = table.next(row);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    if (selection.time) columns.times_ns.push_back(row.time_ns), columns.only_others.push_back(row.only_others);
    columns.rates.push_back(row.values[0]);
  }
  if (columns.rates.empty()) return make_error(table.path(), "found no row of numbers, expected a rate in every line");
  return columns;
}

/// The rates with as many missing values in place of the holes as they have samples. A hole of more than a twentieth of
/// the rows separates two records instead.
std::vector<double> with_gaps(const std::vector<double>& rates, const SampleGrid& grid) {
  std::vector<double> all;
  auto hole = grid.holes.begin();
  for (std::size_t row = 0; row < rates.size(); ++row) {
    if (hole != grid.holes.end() && hole->row == row) {
      const bool is_long = hole->lost > rates.size() / 20;
      all.insert(all.end(), is_long ? 1 : hole->lost, is_long ? evaluation::kAllanBreak : kUnknown);
      ++hole;
    }
    all.push_back(rates[row]);
  }
  return all;
}

/// The rows that are samples: without those where only other columns have a value.
Columns samples_of(const Columns& columns) {
  Columns samples;
  for (std::size_t i = 0; i < columns.rates.size(); ++i) {
    if (columns.only_others[i]) continue;
    samples.rates.push_back(columns.rates[i]);
    samples.times_ns.push_back(columns.times_ns[i]);
  }
  return samples;
}

/// Sets the interval, and puts a gap into the rates where samples are lost.
Result<void> place_in_time(Columns columns, const std::string& time_name, const std::string& path, double given_s,
                           RateSeries& series) {
  if (columns.times_ns.size() < 2) {
    series.rate_deg_per_h = std::move(columns.rates);
    series.interval_source = "assumed: the file has no time";
    return {};
  }
  // Where the samples alone leave two readings, the other rows' times may be the missing ones.
  auto grid = sample_grid(columns.times_ns, path, given_s);
  if (std::ranges::find(columns.only_others, true) != columns.only_others.end()) {
    Columns samples = samples_of(columns);
    auto of_samples = sample_grid(samples.times_ns, path, given_s);
    if (of_samples || !grid) grid = std::move(of_samples), columns = std::move(samples);
  }
  if (!grid) return tl::unexpected<Error>(grid.error());
  series.interval_s = grid->interval_s;
  series.interval_source = "count over span of " + time_name;
  series.rate_deg_per_h = with_gaps(columns.rates, *grid);
  series.notes = grid->notes;
  return {};
}

// prismd's log has one row per second. Partial and missing seconds are gaps, long ones as in append(); a session is a
// record.
Result<RateSeries> read_log_series(const std::string& path, const RateSeriesChoice& choice) {
  RateSeries series;
  series.column = choice.column.empty() ? "rate_deg_per_h" : choice.column;
  auto folder = LogFolder::open(path, choice.axis, series.column);
  if (!folder) return tl::unexpected(folder.error());
  const auto factor = factor_of(choice, tables::read_header(series.column));
  if (!factor) return tl::unexpected(factor.error());
  std::vector<Series> records;
  bool begins = false;
  const auto add = [&](const LogRow& row, bool begins_session) -> Result<void> {
    const compensation::SecondMean& second_mean = row.second_mean;
    if (!series.begin_s) series.begin_s = second_mean.second;
    ++series.rows;
    begins = begins || begins_session;
    const bool valid = !second_mean.partial && !second_mean.implausible.any() && !second_mean.clocks_differ;
    if (!valid || std::isnan(row.value)) return {};
    if (std::exchange(begins, false)) records.push_back({second_mean.second});
    append(records, second_mean.second, row.value * *factor);
    return {};
  };
  const auto left_out = join_rows(*folder, add);
  if (!left_out) return tl::unexpected(left_out.error());
  if (series.rows == 0) return make_error(path, "found no row of numbers, expected a rate in every line");
  series.rate_deg_per_h = joined(std::move(records));
  series.interval_source = "one row per second";
  series.gyro_serial = folder->segments.front().value("gyro_serial");
  series.notes = left_out->lines();
  series.notes.insert(series.notes.end(), folder->absent.begin(), folder->absent.end());
  return series;
}

Result<RateSeries> read_table_series(const std::string& path, const RateSeriesChoice& choice) {
  const double given_s = choice.table.interval_s;
  auto table = tables::PlainTable::open(path, choice.table);
  if (!table) return tl::unexpected<Error>(table.error());
  const auto chosen = choose_columns(*table, choice);
  if (!chosen) return tl::unexpected<Error>(chosen.error());
  RateSeries series;
  const tables::Header& header = table->columns()[chosen->numbers[0]];
  series.column = header.text;
  const auto factor = factor_of(choice, header);
  if (!factor) return tl::unexpected<Error>(factor.error());
  auto columns = read_columns(*table, *chosen);
  if (!columns) return tl::unexpected<Error>(columns.error());
  series.rows = columns->rates.size();
  if (table->has_dates() && !columns->times_ns.empty())
    series.begin_s = columns->times_ns.front() / compensation::kNanosecondsPerSecond;
  RateRows rows{*factor, mean_step_s(columns->times_ns), columns->times_ns, table->has_dates()};
  if (given_s > 0) rows.interval_s = given_s;
  const auto remarks = lines_of(judge_rates(columns->rates, rows), Severity::kRemark);
  const std::string time_name = chosen->time ? table->columns()[chosen->time->column].text : "";
  if (auto placed = place_in_time(std::move(*columns), time_name, path, given_s, series); !placed)
    return tl::unexpected<Error>(placed.error());
  for (double& rate : series.rate_deg_per_h) rate *= *factor;
  series.notes.insert(series.notes.end(), remarks.begin(), remarks.end());
  if (given_s > 0) {
    series.interval_s = given_s;
    series.interval_source = "given";
  }
  if (choice.table.announce) choice.table.announce(table->understood());
  return series;
}

}  // namespace

Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice) {
  std::error_code error;
  const bool log = choice.time_column.empty() && choice.table.interval_s == 0 &&
                   (std::filesystem::is_directory(path, error) || is_log(path));
  if (!log) {
    const auto kind = bytes_kind(path);
    if (!kind) return tl::unexpected<Error>(kind.error());
    if (!kind->empty())
      return make_error(path, fmt::format("found a {}, expected a table or log; make a log of it: prismd CONFIG.json "
                                          "--replay {} --out FOLDER",
                                          *kind, shell_word(path)));
  }
  return log ? read_log_series(path, choice) : read_table_series(path, choice);
}

}  // namespace prism::recordings
