// SPDX-License-Identifier: MIT
// Reads a table of another program as a recording: columns are mapped by name and unit, rows become samples for
// SecondAverager.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>

#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "compensation/second_averager.hpp"
#include "tools/prismcal/recordings/packed_stamps.hpp"
#include "tools/prismcal/recordings/quantity_map.hpp"
#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/recordings/second_judge.hpp"
#include "tools/prismcal/recordings/table_judge.hpp"
#include "tools/prismcal/recordings/table_times.hpp"
#include "tools/prismcal/tables/table_source.hpp"

namespace prism::recordings {
namespace {

constexpr std::array<const char*, 3> kQuantities = {"rate", "temperature", "uhfo"};  // before the sensors

struct Conversion {
  double scale = 1, offset = 0, factor = 1, shift = 0;
  double operator()(double value) const { return (value * scale + offset) * factor + shift; }
};

/// The table with the mapped columns selected.
struct MappedTable {
  std::unique_ptr<tables::TableSource> source;
  std::vector<std::optional<std::size_t>> place;  ///< of each quantity in a block
  std::vector<Conversion> conversion;
  SensorList sensors;  ///< null: none
  bool timed = false;

  double value(std::size_t quantity, const tables::Block& block, std::size_t row) const {
    return place[quantity] ? conversion[quantity](block.columns[*place[quantity]][row]) : kUnknown;
  }
};

Result<MappedTable> open_mapped(const std::string& path, const QuantityMap& map, const SourceOptions& options,
                                bool only_time) {
  MappedTable table;
  auto source = tables::open_table(path, options.table);
  if (!source) return tl::unexpected<Error>(source.error());
  table.source = std::move(*source);
  tables::Selection selection;
  std::vector<std::string> quantities(kQuantities.begin(), kQuantities.end());
  for (const auto& [name, mapped] : map) {
    if (is_sensor(name)) quantities.push_back(name);
  }
  table.place.resize(quantities.size());
  table.conversion.resize(quantities.size());
  std::vector<SensorName> sensors;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const auto at = map.find(quantities[q]);
    if (at == map.end()) continue;
    const auto column = table.source->find(at->second.column);
    if (!column) return tl::unexpected<Error>(column.error());
    const auto unit = unit_of_quantity(quantities[q], at->second, table.source->columns()[*column]);
    if (!unit) return tl::unexpected<Error>(unit.error());
    table.conversion[q] = {at->second.scale, at->second.offset, (*unit)->factor, (*unit)->offset};
    if (q >= kQuantities.size()) sensors.push_back({quantities[q], sensor_unit(**unit)});
    if (only_time) continue;
    table.place[q] = selection.numbers.size();
    selection.numbers.push_back(*column);
  }
  if (!sensors.empty()) table.sensors = std::make_shared<const std::vector<SensorName>>(std::move(sensors));
  if (const auto at = map.find("time"); at != map.end()) {
    const auto column = table.source->find(at->second.column);
    if (!column) return tl::unexpected<Error>(column.error());
    table.timed = true;
    const std::string unit = at->second.unit ? std::string(at->second.unit->name) : std::string();
    selection.time = tables::TimeSelection{*column, unit, at->second.scale, at->second.offset};
  }
  if (auto good = table.source->select(std::move(selection)); !good) return tl::unexpected<Error>(good.error());
  return table;
}

Result<PackedStamps> read_stamps(MappedTable& table) {
  PackedStamps stamps;
  tables::Block block;
  while (true) {
    const auto more = table.source->next(block);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) return stamps;
    if (auto good = append_times(stamps, *table.source, block); !good) return tl::unexpected<Error>(good.error());
  }
}

/// Averages the rows to seconds. `times_ns`: ends of the samples; empty: `interval_s` apart.
class Averaging {
 public:
  Averaging(const PackedStamps& times_ns, const SourceOptions& options, LeaveOut& leave_out, SensorList sensors)
      : times_(times_ns),
        interval_s_(options.table.interval_s),
        judged_(options.judged),
        leave_out_(leave_out),
        sensors_(sensors_of_list(sensors).size()),
        averager_(std::move(sensors)) {}

  Result<void> begin(bool is_date) {
    return leave_out_.begin(times_.empty() ? 0 : compensation::second_number(times_.front()), is_date);
  }
  void add(const MappedTable& table, const tables::Block& block, std::size_t row) {
    Sample sample;
    sample.time_ns = time_of(index_);
    const std::int64_t before = index_ > 0 ? time_of(index_ - 1) : sample.time_ns - first_step_ns();
    sample.interval_s = static_cast<double>(sample.time_ns - before) / 1e9;
    sample.rate_deg_per_h = table.value(0, block, row);
    sample.temperature_degc = table.value(1, block, row);
    sample.uhfo_v = table.value(2, block, row);
    for (std::size_t i = 0; i < sensors_.size(); ++i) sensors_[i] = table.value(kQuantities.size() + i, block, row);
    ++index_;
    if (leave_out_.contains(compensation::second_number(sample.time_ns))) return;
    const QuantitySet implausible = judged_ ? judge_.push(sample, block.lines[row]) : QuantitySet();
    if (const auto second_mean = averager_.push(sample, implausible, sensors_)) second_means_.push_back(*second_mean);
  }
  /// Judges the seconds.
  Result<void> finish(const std::string& path, bool is_date, Recording& recording) {
    if (const auto second_mean = averager_.finish()) second_means_.push_back(*second_mean);
    if (!judged_) return {};
    const auto notes = judge_.finish(path, judge_seconds(second_means_, is_date));
    if (!notes) return tl::unexpected<Error>(notes.error());
    recording.notes.insert(recording.notes.end(), notes->begin(), notes->end());
    return {};
  }
  const std::vector<compensation::SecondMean>& second_means() const { return second_means_; }

 private:
  std::int64_t time_of(std::size_t index) const {
    return times_.empty() ? std::llround(static_cast<double>(index + 1) * interval_s_ * 1e9) : times_[index];
  }
  std::int64_t first_step_ns() const {
    if (times_.size() > 1) return times_[1] - times_[0];
    return times_.empty() ? std::llround(interval_s_ * 1e9) : 1'000'000'000;
  }

  const PackedStamps& times_;
  double interval_s_;
  bool judged_;
  LeaveOut& leave_out_;
  std::vector<double> sensors_;  ///< of the row
  compensation::SecondAverager averager_;
  TableJudge judge_;
  std::vector<compensation::SecondMean> second_means_;
  std::size_t index_ = 0;
};

}  // namespace

Result<Recording> read_mapped(const std::string& path, const SourceOptions& options, LeaveOut leave_out,
                              SecondConsumer& consumer) {
  const auto map = parse_map(options.map);
  if (!map) return tl::unexpected<Error>(map.error());
  const bool timed = map->contains("time");
  Recording recording;
  PackedStamps times;
  const auto stated = options.table.interval_s > 0 ? std::optional(options.table.interval_s) : std::nullopt;
  if (timed) {
    auto table = open_mapped(path, *map, options, true);
    if (!table) return tl::unexpected<Error>(table.error());
    auto stamps = read_stamps(*table);
    if (!stamps) return tl::unexpected<Error>(stamps.error());
    if (stamps->size() > 1) {
      const auto grid = sample_grid(*stamps, path, stated);
      if (!grid) return tl::unexpected<Error>(grid.error());
      times = grid->times_ns(*stamps);
      recording.notes = grid_notes(*grid, stamps->size());
    } else {
      times = std::move(*stamps);
    }
  }
  auto table = open_mapped(path, *map, options, false);
  if (!table) return tl::unexpected<Error>(table.error());
  if (!timed && !(options.table.interval_s > 0))
    return make_error(path, "found no time, expected --map time=COLUMN:UNIT or --interval SECONDS");
  recording.name = std::filesystem::path(path).stem().string();
  Averaging averaging(times, options, leave_out, table->sensors);
  const bool is_date = table->source->time() && table->source->time()->has_date;
  if (auto good = averaging.begin(is_date); !good) return tl::unexpected<Error>(good.error());
  tables::Block block;
  while (true) {
    const auto more = table->source->next(block);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    for (std::size_t row = 0; row < block.rows; ++row) averaging.add(*table, block, row);
  }
  if (auto good = averaging.finish(path, is_date, recording); !good) return tl::unexpected<Error>(good.error());
  const auto sum = sha256_of_file(path);
  if (!sum) return tl::unexpected<Error>(sum.error());
  recording.files.push_back({path, *sum, table->source->counts().rows});
  if (table->source->counts().rows == 0) return make_error(path, "found no row below a line of names");
  SecondFeed feed(recording, leave_out, is_date, consumer);
  Result<void> fed;
  for (auto at = averaging.second_means().begin(); fed && at != averaging.second_means().end(); ++at)
    fed = feed.push(*at, false);
  if (fed) fed = feed.finish();
  if (options.table.announce) {
    std::string line = table->source->understood();
    for (const auto* texts : {&recording.notes, &recording.questions}) {
      for (const std::string& text : *texts) line += "; " + text;
    }
    options.table.announce(line);
  }
  if (!fed) return tl::unexpected<Error>(fed.error());
  return recording;
}

}  // namespace prism::recordings
