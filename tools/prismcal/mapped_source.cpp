// SPDX-License-Identifier: MIT
// Reads a table of another program as a recording: columns are mapped by name and unit, rows become samples for
// SecondAverager.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include "compensation/second_averager.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/quantity_map.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/sample_grid.hpp"

namespace prism::recordings {
namespace {

constexpr std::array<const char*, 3> kMapped = {"rate", "temperature", "uhfo"};  // before the sensors

struct Conversion {
  double scale = 1, offset = 0, factor = 1, shift = 0;
  double operator()(double value) const { return (value * scale + offset) * factor + shift; }
};

/// The columns of a table that are mapped to quantities, and their values of a row.
class MappedColumns {
 public:
  /// Selects the columns.
  static Result<MappedColumns> of(tables::PlainTable& table, const QuantityMap& map) {
    MappedColumns columns;
    tables::Selection selection;
    std::vector<SensorName> sensors;
    for (const auto& [quantity, mapped] : map) {
      const auto column = table.find(mapped.column);
      if (!column) return tl::unexpected<Error>(column.error());
      if (quantity == "time") {
        const std::string unit = mapped.unit ? std::string(mapped.unit->name) : std::string();
        selection.time = tables::TimeSelection{*column, unit, mapped.scale, mapped.offset};
        continue;
      }
      const auto unit = unit_of_quantity(quantity, mapped, table.columns()[*column]);
      if (!unit) return tl::unexpected<Error>(unit.error());
      const auto* const at = std::find(kMapped.begin(), kMapped.end(), quantity);
      columns.place_.push_back(at < kMapped.end() ? static_cast<std::size_t>(at - kMapped.begin())
                                                  : kMapped.size() + sensors.size());
      columns.conversion_.push_back({mapped.scale, mapped.offset, (*unit)->factor, (*unit)->offset});
      if (at == kMapped.end()) sensors.push_back({quantity, sensor_unit(**unit)});
      selection.numbers.push_back(*column);
    }
    columns.values_.assign(kMapped.size() + sensors.size(), kUnknown);
    if (!sensors.empty()) columns.sensors_ = std::make_shared<const std::vector<SensorName>>(std::move(sensors));
    if (auto good = table.select(std::move(selection)); !good) return tl::unexpected<Error>(good.error());
    return columns;
  }

  const SensorList& sensors() const { return sensors_; }
  /// Rate, temperature, voltage, sensors.
  std::span<const double> values_of(const tables::Row& row) {
    for (std::size_t i = 0; i < place_.size(); ++i) values_[place_[i]] = conversion_[i](row.values[i]);
    return values_;
  }

 private:
  std::vector<std::size_t> place_;  ///< in values_, of each selected column
  std::vector<Conversion> conversion_;
  SensorList sensors_;  ///< null: none
  std::vector<double> values_;
};

/// Averages the rows to seconds.
class Averaging {
 public:
  Averaging(bool judged, LeaveOut& leave_out, SensorList sensors)
      : judged_(judged), leave_out_(leave_out), averager_(std::move(sensors)) {}

  /// The first row waits for the second, which shows its step.
  void add(std::int64_t time_ns, std::span<const double> values, std::size_t line) {
    if (lines_++ == 0) {
      first_ = {time_ns, {values.begin(), values.end()}, line};
      return;
    }
    if (lines_ == 2) add_first(time_ns - first_.time_ns);
    add(time_ns, time_ns - last_ns_, values, line);
  }
  /// Judges the seconds.
  Result<std::vector<Finding>> finish(const std::string& path, bool is_date) {
    if (lines_ == 1) add_first(compensation::kNanosecondsPerSecond);
    if (const auto second_mean = averager_.finish()) second_means_.push_back(*second_mean);
    if (!judged_) return std::vector<Finding>();
    return judge_.finish(path, judge_seconds(second_means_, is_date));
  }
  const std::vector<compensation::SecondMean>& second_means() const { return second_means_; }

 private:
  struct First {
    std::int64_t time_ns = 0;
    std::vector<double> values;
    std::size_t line = 0;
  };

  void add_first(std::int64_t step_ns) { add(first_.time_ns, step_ns, first_.values, first_.line); }
  void add(std::int64_t time_ns, std::int64_t step_ns, std::span<const double> values, std::size_t line) {
    // A stamp just after the end of a second, by a tenth of a step, is at the end: days and hours have few digits.
    constexpr std::int64_t kMost_ns = 100'000'000;
    const std::int64_t second = compensation::second_number(time_ns), usual_ns = std::min(step_ns, last_step_ns_);
    const std::int64_t after_ns = time_ns - second * compensation::kNanosecondsPerSecond;
    Sample sample;
    sample.time_ns = after_ns <= std::min(kMost_ns, usual_ns / 10) ? time_ns - after_ns : time_ns;
    sample.time_ns = std::max(sample.time_ns, last_sample_ns_ + 1);
    sample.interval_s = static_cast<double>(std::max<std::int64_t>(1, step_ns)) / 1e9;
    sample.rate_deg_per_h = values[0];
    sample.temperature_degc = values[1];
    sample.uhfo_v = values[2];
    last_ns_ = time_ns;
    last_step_ns_ = step_ns;
    last_sample_ns_ = sample.time_ns;
    if (leave_out_.contains(compensation::second_number(sample.time_ns))) return;
    const QuantitySet implausible = judged_ ? judge_.push(sample, line) : QuantitySet();
    const auto second_mean = averager_.push(sample, implausible, values.subspan(kMapped.size()));
    if (second_mean) second_means_.push_back(*second_mean);
  }

  bool judged_;
  LeaveOut& leave_out_;
  compensation::SecondAverager averager_;
  RowJudge judge_;
  std::vector<compensation::SecondMean> second_means_;
  First first_;
  std::size_t lines_ = 0;
  std::int64_t last_ns_ = 0, last_step_ns_ = INT64_MAX, last_sample_ns_ = INT64_MIN;
};

/// Samples that are lost; the options that a window needs if its rows are far apart.
void add_findings_on_times(const std::vector<std::int64_t>& rate_stamps_ns, const std::vector<std::int64_t>& stamps_ns,
                           const std::string& path, std::optional<double> interval_s, std::vector<Finding>& findings) {
  if (stamps_ns.size() < 2) return;
  auto grid = sample_grid(rate_stamps_ns, path, interval_s);
  if (!grid) grid = sample_grid(stamps_ns, path, interval_s);
  if (!grid)
    return add_remarks(findings, "time",
                       {"time: " + grid.error().what + "; rows are averaged in the second of their times"});
  add_remarks(findings, "time", grid->notes());
  constexpr double kMostGap_s = 6;  // FeatureDefinition::max_gap_s, and the row's second
  if (grid->interval_s <= kMostGap_s) return;
  const double step_s = std::ceil(grid->interval_s);
  add_remarks(findings, "step",
              {fmt::format("a row every {:.6g} s needs --max-gap {:.0f} --end-mean {:.0f} --window {:.0f}",
                           grid->interval_s, step_s, std::max(10.0, step_s), std::max(100.0, 10 * step_s))});
}

}  // namespace

Result<Recording> read_mapped(const std::string& path, const SourceOptions& options, LeaveOut leave_out,
                              const SecondConsumer& consumer) {
  const auto map = parse_map(options.map);
  if (!map) return tl::unexpected<Error>(map.error());
  const double interval_s = options.table.interval_s;
  const bool timed = map->contains("time"), stated = interval_s > 0;
  auto table = tables::PlainTable::open(path, options.table);
  if (!table) return tl::unexpected<Error>(table.error());
  if (!timed && !stated)
    return make_error(path, "found no time, expected --map time=COLUMN:UNIT or --interval SECONDS");
  auto columns = MappedColumns::of(*table, *map);
  if (!columns) return tl::unexpected<Error>(columns.error());
  const bool is_date = table->has_dates();
  Averaging averaging(options.judged, leave_out, columns->sensors());
  StatedTimes times(interval_s);
  std::vector<std::int64_t> stamps_ns, rate_stamps_ns;  // of all rows, of those with a rate
  tables::Row row;
  for (std::size_t rows = 0;;) {
    const auto more = table->next(row);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    if (timed && row.only_others) continue;
    const std::int64_t count_ns = std::llround(static_cast<double>(++rows) * interval_s * 1e9);
    const std::int64_t time_ns = !timed ? count_ns : stated ? times.push(row.time_ns) : row.time_ns;
    const auto values = columns->values_of(row);
    if (rows == 1) {
      if (auto good = leave_out.begin(compensation::second_number(time_ns), is_date); !good)
        return tl::unexpected<Error>(good.error());
    }
    averaging.add(time_ns, values, row.line);
    if (timed) stamps_ns.push_back(row.time_ns);
    if (timed && std::isfinite(values[0])) rate_stamps_ns.push_back(row.time_ns);
  }
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  add_findings_on_times(rate_stamps_ns, stamps_ns, path, stated ? std::optional(interval_s) : std::nullopt,
                        recording.findings);
  const auto judged = averaging.finish(path, is_date);
  if (!judged) return tl::unexpected<Error>(judged.error());
  recording.findings.insert(recording.findings.end(), judged->begin(), judged->end());
  recording.files.push_back({path, table->sha256(), table->rows()});
  SecondFeed feed(recording, leave_out, is_date, consumer);
  Result<void> fed;
  for (auto at = averaging.second_means().begin(); fed && at != averaging.second_means().end(); ++at)
    fed = feed.push(*at, false);
  if (fed) fed = feed.finish();
  if (options.table.announce) {
    std::string line = table->understood();
    for (const Severity severity : {Severity::kRemark, Severity::kQuestion}) {
      for (const std::string& text : lines_of(recording.findings, severity)) line += "; " + text;
    }
    options.table.announce(line);
  }
  if (!fed) return tl::unexpected<Error>(fed.error());
  return recording;
}

}  // namespace prism::recordings
