// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/quantity_map.hpp"
#include "tools/prismcal/recordings/recording.hpp"

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

/// The findings of a training with the columns that the table names, which are read again, but for those on the time;
/// the reason if it cannot use them.
std::vector<std::string> remarks_on(const tables::PlainTable& table, const tables::TableOptions& options) {
  SourceOptions source;
  source.table = options;
  source.table.silence();
  source.map = suggested_map(table, options);
  std::erase_if(source.map, [](const std::string& entry) { return entry.ends_with(":UNIT"); });
  const auto is_time = [](const std::string& entry) { return entry.starts_with("time="); };
  if (options.interval_s == 0 && std::none_of(source.map.begin(), source.map.end(), is_time)) return {};
  const auto ignore = [](const auto&...) { return Result<void>(); };
  auto recording = read_recording(table.path(), source, {ignore, ignore});
  if (!recording) return {recording.error().what};
  std::erase_if(recording->findings, [](const Finding& finding) { return finding.kind == "time"; });  // TimeSummary
  std::vector<std::string> remarks = recording->remarks();
  for (std::string& question : recording->questions()) remarks.push_back(std::move(question));
  return remarks;
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
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) summary.problem = more.error().text();
    if (!more || !*more) break;
    for (std::size_t i = 0; i < numbers.size(); ++i) take(row.values[i], summary.columns[numbers[i]], courses[i]);
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
  if (rate && summary.problem.empty()) summary.remarks = remarks_on(*table, options);
  return summary;
}

}  // namespace prism::recordings
