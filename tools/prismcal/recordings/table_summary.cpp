// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "compensation/plausibility.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/packed_stamps.hpp"
#include "tools/prismcal/recordings/quantity_map.hpp"
#include "tools/prismcal/recordings/rate_judge.hpp"
#include "tools/prismcal/recordings/table_judge.hpp"
#include "tools/prismcal/recordings/table_times.hpp"

namespace prism::recordings {
namespace {

constexpr std::size_t kCourse = 64;

/// Means of equal numbers of rows; the number doubles whenever there are twice as many means as wanted.
class Course {
 public:
  void add(double value) {
    if (std::isfinite(value)) sum_ += value, ++known_;
    if (++rows_ < each_) return;
    means_.push_back(known_ > 0 ? sum_ / static_cast<double>(known_) : kUnknown);
    sum_ = 0, known_ = rows_ = 0;
    if (means_.size() < 2 * kCourse) return;
    for (std::size_t i = 0; i < kCourse; ++i) {
      const double a = means_[2 * i], b = means_[2 * i + 1];
      means_[i] = std::isnan(a) ? b : std::isnan(b) ? a : (a + b) / 2;
    }
    means_.resize(kCourse);
    each_ *= 2;
  }
  std::vector<double> means() const {
    if (means_.size() <= kCourse) return means_;
    std::vector<double> half;
    for (std::size_t i = 0; i + 1 < means_.size(); i += 2) {
      const double a = means_[i], b = means_[i + 1];
      half.push_back(std::isnan(a) ? b : std::isnan(b) ? a : (a + b) / 2);
    }
    return half;
  }

 private:
  std::vector<double> means_;
  double sum_ = 0;
  std::size_t known_ = 0, rows_ = 0, each_ = 1;
};

void take(const std::vector<double>& values, ColumnSummary& column, Course& course) {
  for (const double value : values) {
    course.add(value);
    if (!std::isfinite(value)) continue;
    column.smallest = std::isnan(column.smallest) ? value : std::min(column.smallest, value);
    column.largest = std::isnan(column.largest) ? value : std::max(column.largest, value);
  }
}

void summarise_time(const tables::TableSource& table, const PackedStamps& stamps, TableSummary& summary) {
  if (!table.time() || stamps.empty()) return;
  TimeSummary& time = *summary.time;
  time.format = table.time()->text;
  time.is_date = table.time()->has_date;
  time.first_ns = stamps.front();
  time.last_ns = stamps.back();
  std::int64_t before = stamps.front();
  stamps.for_each(1, stamps.size(),
                  [&](std::size_t, std::int64_t stamp) { time.backward += stamp < std::exchange(before, stamp); });
  if (time.backward > 0) return;
  if (auto grid = sample_grid(stamps, table.path()))
    time.grid = std::move(*grid);
  else
    time.no_grid = std::move(grid.error().what);
}

/// "T_degC: values outside -90 to 200 degC", "looks like kelvin".
void add_range_remarks(TableSummary& summary) {
  const compensation::PlausibilityLimits limits;
  for (const ColumnSummary& column : summary.columns) {
    const tables::Unit* unit = column.header.unit;
    if (!unit || !std::isfinite(column.smallest)) continue;
    const double low = column.smallest * unit->factor + unit->offset,
                 high = column.largest * unit->factor + unit->offset;
    const bool temperature = unit->quantity == "temperature";
    if (!temperature && unit->quantity != "uhfo") continue;
    const compensation::SensorLimits& range = temperature ? limits.temperature : limits.uhfo;
    if (temperature && like_kelvin(low) && like_kelvin(high))
      summary.remarks.push_back(
          fmt::format("{}: looks like kelvin: --map temperature={}:K*1", column.header.text, column.header.text));
    else if (low < range.low || high > range.high)
      summary.remarks.push_back(
          fmt::format("{}: values outside {} to {} {} are not used, and more than 1 % is an error", column.header.text,
                      range.low, range.high, temperature ? "degC" : "V"));
  }
}

}  // namespace

Result<TableSummary> summarise_table(const std::string& path, const tables::TableOptions& options) {
  auto opened = tables::open_table(path, options);
  if (!opened) return tl::unexpected<Error>(opened.error());
  tables::TableSource& table = **opened;
  TableSummary summary;
  summary.dialect = table.dialect_text();
  summary.command = train_command(table, options);
  const auto rate = rate_column(table);
  summary.states_rate = rate.has_value();
  tables::Selection selection;
  const auto time = table.time_column();
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    summary.columns.push_back({table.columns()[i], table.kind(i), kUnknown, kUnknown, 0, {}});
    if (summary.columns.back().kind == tables::ColumnKind::kNumber) selection.numbers.push_back(i);
  }
  if (time) {
    selection.time = tables::TimeSelection{*time, "", 1, 0};
    summary.time = TimeSummary{table.columns()[*time].text, "", 0, 0, false, 0, {}, {}};
  }
  const std::vector<std::size_t> numbers = selection.numbers;
  if (auto good = table.select(selection); !good) {
    summary.problem = good.error().text();
    summary.time.reset();
    selection.time.reset();
    if (good = table.select(selection); !good) return tl::unexpected<Error>(good.error());
  }
  std::vector<Course> courses(numbers.size());
  PackedStamps stamps;
  PackedSeries rates;
  tables::Block block;
  while (true) {
    const auto more = table.next(block);
    for (std::size_t i = 0; i < numbers.size() && i < block.columns.size(); ++i) {
      take(block.columns[i], summary.columns[numbers[i]], courses[i]);
      if (rate != numbers[i]) continue;
      for (const double value : block.columns[i]) rates.push(value);
    }
    if (auto good = append_times(stamps, table, block); !good) {
      if (summary.problem.empty()) summary.problem = good.error().text();
      stamps.push(block.time_ns);
    }
    if (!more) summary.problem = more.error().text();
    if (!more || !*more) break;
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    summary.columns[numbers[i]].holes = table.counts().holes[i];
    summary.columns[numbers[i]].course = courses[i].means();
  }
  summary.rows = table.counts().rows;
  summary.torn = table.counts().torn;
  summarise_time(table, stamps, summary);
  add_range_remarks(summary);
  if (!rate) return summary;
  const double unit_deg_per_h = table.columns()[*rate].unit->factor;
  for (std::string& remark : judge_rates(rates, judgement_of(table, unit_deg_per_h, rates.size(), stamps)))
    summary.remarks.push_back(std::move(remark));
  return summary;
}

}  // namespace prism::recordings
