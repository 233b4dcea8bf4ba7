// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/plausibility.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/findings.hpp"
#include "tools/prismcal/recordings/quantity_map.hpp"

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
    means_ = halved();
    each_ *= 2;
  }
  std::vector<double> means() const { return means_.size() > kCourse ? halved() : means_; }

 private:
  std::vector<double> halved() const {
    std::vector<double> half;
    for (std::size_t i = 0; i + 1 < means_.size(); i += 2) {
      const double a = means_[i], b = means_[i + 1];
      half.push_back(std::isnan(a) ? b : std::isnan(b) ? a : (a + b) / 2);
    }
    return half;
  }

  std::vector<double> means_;
  double sum_ = 0;
  std::size_t known_ = 0, rows_ = 0, each_ = 1;
};

void take(double value, ColumnSummary& column, Course& course) {
  course.add(value);
  if (!std::isfinite(value)) return;
  column.smallest = std::isnan(column.smallest) ? value : std::min(column.smallest, value);
  column.largest = std::isnan(column.largest) ? value : std::max(column.largest, value);
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
  auto table = tables::PlainTable::open(path, options);
  if (!table) return tl::unexpected<Error>(table.error());
  TableSummary summary;
  summary.form = table->form_text();
  summary.command = train_command(*table, options);
  const auto rate = rate_column(*table);
  summary.states_rate = rate.has_value();
  tables::Selection selection;
  for (std::size_t i = 0; i < table->columns().size(); ++i) {
    summary.columns.push_back({table->columns()[i], table->kind(i), kUnknown, kUnknown, 0, {}});
    if (table->kind(i) == tables::ColumnKind::kNumber) selection.numbers.push_back(i);
  }
  const std::vector<std::size_t> numbers = selection.numbers;
  const auto time = table->time_column();
  if (time) selection.time = tables::TimeSelection{*time};
  if (auto good = table->select(selection); !good) {
    summary.problem = good.error().text();
    selection.time.reset();
    if (good = table->select(selection); !good) return tl::unexpected<Error>(good.error());
  }
  std::vector<Course> courses(numbers.size());
  std::vector<std::int64_t> stamps_ns;
  std::vector<double> rates;
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) summary.problem = more.error().text();
    if (!more || !*more) break;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      take(row.values[i], summary.columns[numbers[i]], courses[i]);
      if (rate == numbers[i]) rates.push_back(row.values[i]);
    }
    if (table->time()) stamps_ns.push_back(row.time_ns);
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    summary.columns[numbers[i]].missing = table->missing(i);
    summary.columns[numbers[i]].course = courses[i].means();
  }
  summary.rows = table->rows();
  summary.torn = table->torn();
  if (!stamps_ns.empty()) {
    summary.time = TimeSummary{table->columns()[*time].text,
                               table->time()->text(),
                               stamps_ns.front(),
                               stamps_ns.back(),
                               table->has_dates(),
                               {},
                               {}};
    const auto interval_s = options.interval_s > 0 ? std::optional(options.interval_s) : std::nullopt;
    if (auto grid = sample_grid(stamps_ns, path, interval_s))
      summary.time->grid = std::move(*grid);
    else
      summary.time->no_grid = std::move(grid.error().what);
  }
  add_range_remarks(summary);
  if (!rate) return summary;
  const RateRows rows{table->columns()[*rate].unit->factor, mean_step_s(stamps_ns), stamps_ns, table->has_dates()};
  for (std::string& remark : lines_of(judge_rates(rates, rows), Severity::kRemark))
    summary.remarks.push_back(std::move(remark));
  return summary;
}

}  // namespace prism::recordings
