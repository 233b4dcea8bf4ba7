// SPDX-License-Identifier: MIT
// --map: which column of a table is the rate, the temperature, the voltage, the time or a sensor, and in which unit;
// and a table as a recording.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "compensation/second_averager.hpp"
#include "compensation/sensors.hpp"
#include "tools/prismcal/findings.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/series.hpp"

namespace prism::recordings {
namespace {

constexpr const char* kGrammar =
    "QUANTITY=COLUMN:UNIT[*SCALE][+OFFSET], as rate=rate_x:deg/s or rate=Gx:deg/s*0.061-1.2";

struct MappedColumn {
  std::string column;
  const tables::Unit* unit = nullptr;  ///< null: by the column's header
  double scale = 1, offset = 0;        ///< file value · scale + offset is in `unit`
  bool is_scaled = false;              ///< scale or offset is stated: the unit may differ from the header's
};
/// By "rate", "temperature", "uhfo", "time", or the name of a sensor of a line, LINE.NAME.
using QuantityMap = std::map<std::string, MappedColumn>;

/// Parses "*0.061-1.2" after a unit. Returns false if the text is invalid.
bool read_scale_and_offset(std::string_view text, MappedColumn& mapped) {
  const auto number = [&text](double& value) {
    text.remove_prefix(text.starts_with('*') || text.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return error == std::errc() && std::isfinite(value);
  };
  if (text.starts_with('*') && !(number(mapped.scale) && mapped.scale != 0)) return false;
  if ((text.starts_with('+') || text.starts_with('-')) && !number(mapped.offset)) return false;
  return text.empty();
}

bool is_quantity(std::string_view name) {
  return std::any_of(std::begin(tables::kUnits), std::end(tables::kUnits),
                     [&](const tables::Unit& unit) { return unit.quantity == name; });
}

/// Units of sensors besides those of temperatures and voltages.
constexpr tables::Unit kOtherUnits[] = {
    {"", "A", 1, 0, ""}, {"", "mA", 1, 0, ""}, {"", "Pa", 1, 0, ""}, {"", "g", 1, 0, ""}};

/// True for "daq.uhfo": a sensor, not one of the four.
bool is_sensor(const std::string& quantity) {
  return quantity.find('.') != std::string::npos && is_sensor_name(quantity);
}

bool fits(const std::string& quantity, const tables::Unit& unit) {
  return unit.quantity == quantity ||
         (is_sensor(quantity) && (unit.quantity == "temperature" || unit.quantity == "uhfo" || unit.quantity.empty()));
}

const tables::Unit* find_unit(const std::string& quantity, std::string_view name) {
  using Units = std::span<const tables::Unit>;
  for (const Units units : {Units(tables::kUnits), Units(kOtherUnits)}) {
    for (const tables::Unit& unit : units) {
      if (unit.name == name && fits(quantity, unit)) return &unit;
    }
  }
  return nullptr;
}

std::string known_units(const std::string& quantity) {
  constexpr const char* kOfSensors = "degC, K, degF, V, mV, A, mA, Pa or g";
  if (is_sensor(quantity)) return kOfSensors;
  std::string known;
  for (const tables::Unit& unit : tables::kUnits) {
    if (quantity.empty() || unit.quantity == quantity)
      known += fmt::format("{}{} in {}", known.empty() ? "" : ", ", unit.quantity, unit.name);
  }
  return quantity.empty() ? known + ", a sensor LINE.NAME in " + kOfSensors : known;
}

/// Parses "QUANTITY=COLUMN[:UNIT[*SCALE][+OFFSET]]" entries. Errors: the grammar, an unknown unit, no rate.
Result<QuantityMap> parse_map(const std::vector<std::string>& entries) {
  QuantityMap map;
  for (const std::string& entry : entries) {
    const std::size_t equals = entry.find('=');
    if (equals == std::string::npos || equals + 1 == entry.size())
      return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    const std::string quantity = entry.substr(0, equals);
    const bool known = is_quantity(quantity) || is_sensor(quantity);
    const std::size_t colon = entry.rfind(':');
    const bool has_unit = colon != std::string::npos && colon > equals;
    if (!has_unit && !known)
      return make_error("--map", fmt::format("found {}, expected one of: {}", quantity, known_units("")));
    MappedColumn mapped;
    mapped.column = entry.substr(equals + 1, has_unit ? colon - equals - 1 : std::string::npos);
    if (has_unit) {
      const std::size_t scale_at = entry.find_first_of("*+-", colon);  // not in any unit name
      const std::string unit = entry.substr(colon + 1, scale_at - colon - 1);
      mapped.unit = find_unit(quantity, unit);
      mapped.is_scaled = scale_at != std::string::npos;
      if (!mapped.unit)
        return make_error("--map", fmt::format("found {} in \"{}\", expected {}{}", quantity, unit,
                                               known ? "" : "one of: ", known_units(known ? quantity : "")));
      if (mapped.is_scaled && !read_scale_and_offset(std::string_view(entry).substr(scale_at), mapped))
        return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    }
    if (!map.emplace(quantity, std::move(mapped)).second)
      return make_error("--map", "found " + quantity + " twice, expected it once");
  }
  if (!map.contains("rate")) return make_error("--map", "found no rate, expected rate=COLUMN:UNIT");
  return map;
}

// A unit at the end of a name may be a part of the name, so it counts only for the same quantity.
bool contradicts(const tables::Header& header, const tables::Unit& unit) {
  if (!header.unit || (!header.stated && header.unit->quantity != unit.quantity)) return false;
  return header.unit->quantity != unit.quantity || header.unit->factor != unit.factor ||
         header.unit->offset != unit.offset;
}

/// The unit of a quantity: of the map, else of the header. Errors: neither states one, or they contradict.
Result<const tables::Unit*> unit_of_quantity(const std::string& quantity, const MappedColumn& mapped,
                                             const tables::Header& header) {
  if (mapped.unit) {
    if (mapped.is_scaled || !contradicts(header, *mapped.unit)) return mapped.unit;
    return make_error("--map", fmt::format("found {}={}:{}, but the header \"{}\" states {}; expected that unit, or "
                                           "{}={}:{}*1 if the header is wrong",
                                           quantity, mapped.column, mapped.unit->name, header.text, header.unit->name,
                                           quantity, mapped.column, mapped.unit->name));
  }
  if (header.unit && fits(quantity, *header.unit)) return header.unit;
  return make_error("--map", fmt::format("found {}={} without a unit, and none in the header \"{}\", expected {}",
                                         quantity, mapped.column, header.text, known_units(quantity)));
}

/// The first column of numbers with the unit of a quantity.
std::optional<std::size_t> column_of(const tables::PlainTable& table, std::string_view quantity) {
  return table.first_that([&](std::size_t i) {
    const tables::Unit* const unit = table.columns()[i].unit;
    return table.kind(i) == tables::ColumnKind::kNumber && unit && unit->quantity == quantity;
  });
}

std::optional<std::size_t> column_named_uhfo(const tables::PlainTable& table) {
  return table.first_that([&](std::size_t i) {
    const tables::Header& header = table.columns()[i];
    return table.kind(i) == tables::ColumnKind::kNumber && !header.unit &&
           tables::lower(header.name).find("uhfo") != std::string::npos;
  });
}

/// The options that were stated, as words of a command line.
std::string options_text(const tables::TableOptions& options) {
  std::string text;
  if (!options.decimal.empty()) text += " --decimal " + options.decimal;
  if (!options.time_unit.empty()) text += " --time-unit " + options.time_unit;
  if (options.interval_s > 0) text += fmt::format(" --interval {}", options.interval_s);
  return text;
}

}  // namespace

std::optional<std::size_t> rate_column(const tables::PlainTable& table) { return column_of(table, "rate"); }

std::vector<std::string> suggested_map(const tables::PlainTable& table, const tables::TableOptions& options) {
  std::vector<std::string> entries;
  const auto& columns = table.columns();
  // Names that --map would split are given as numbers.
  const auto name_of = [&](std::size_t i) {
    return columns[i].text.find_first_of(",:=") == std::string::npos ? columns[i].text : std::to_string(i + 1);
  };
  for (const std::string quantity : {"rate", "temperature", "uhfo"}) {
    if (const auto i = column_of(table, quantity))
      entries.push_back(fmt::format("{}={}:{}", quantity, name_of(*i), columns[*i].unit->name));
    else if (quantity != "uhfo")
      entries.push_back(quantity + "=COLUMN:UNIT");
    else if (const auto named = column_named_uhfo(table))
      entries.push_back("uhfo=" + name_of(*named) + ":UNIT");
  }
  if (const auto time = table.time_column()) {
    const tables::Unit* const unit = columns[*time].unit;
    std::string entry = "time=" + name_of(*time);
    if (table.kind(*time) == tables::ColumnKind::kNumber && options.time_unit.empty())
      entry += unit && unit->quantity == "time" ? ":" + std::string(unit->name) : ":UNIT";
    entries.push_back(entry);
  }
  return entries;
}

std::string train_command(const tables::PlainTable& table, const tables::TableOptions& options) {
  const std::vector<std::string> entries = suggested_map(table, options);
  std::string text = "prismcal train " + shell_word(table.path()) + options_text(options), inputs;
  bool timed = options.interval_s > 0;
  for (const std::string& entry : entries) {
    text += " --map " + shell_word(entry);
    timed = timed || entry.starts_with("time=");
    if (entry.starts_with("temperature=")) inputs += ",T,dTdt";
    if (entry.starts_with("uhfo=")) inputs += ",U";
  }
  if (!timed) text += " --interval SECONDS";
  text += " --latitude DEG --elevation DEG";  // train rejects the placeholders
  if (!inputs.empty()) text += " --inputs " + inputs.substr(1);
  return text + " --out model.json";
}

namespace {

constexpr std::array<const char*, 3> kMapped = {"rate", "temperature", "uhfo"};  // before the sensors

/// The sensor's unit to which `unit` is converted.
std::string sensor_unit(const tables::Unit& unit) {
  return unit.quantity == "temperature" ? "degC" : unit.quantity == "uhfo" ? "V" : std::string(unit.name);
}

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
      const auto* const at = std::ranges::find(kMapped, quantity);
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
                           const std::string& path, double interval_s, std::vector<Finding>& findings) {
  if (stamps_ns.size() < 2) return;
  auto grid = sample_grid(rate_stamps_ns, path, interval_s);
  if (!grid) grid = sample_grid(stamps_ns, path, interval_s);
  if (!grid)
    return add_remarks(findings, "time",
                       {"time: " + grid.error().what + "; rows are averaged in the second of their times"});
  add_remarks(findings, "time", grid->notes);
  constexpr double kMostGap_s = 6;  // FeatureDefinition::max_gap_s, and the row's second
  if (grid->interval_s <= kMostGap_s) return;
  add_remarks(findings, "step", {step_advice(grid->interval_s)});
}

}  // namespace

// The rows become samples for SecondAverager.
Result<void> read_mapped(const std::string& path, const SourceOptions& options, SecondFeed& feed) {
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
  Averaging averaging(options.judged, feed.leave_out(), columns->sensors());
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
      if (auto good = feed.leave_out().begin(compensation::second_number(time_ns), is_date); !good) return good;
    }
    averaging.add(time_ns, values, row.line);
    if (timed) stamps_ns.push_back(row.time_ns);
    if (timed && std::isfinite(values[0])) rate_stamps_ns.push_back(row.time_ns);
  }
  Recording& recording = feed.recording();
  recording.is_date = is_date;
  add_findings_on_times(rate_stamps_ns, stamps_ns, path, interval_s, recording.findings);
  const auto judged = averaging.finish(path, is_date);
  if (!judged) return tl::unexpected<Error>(judged.error());
  recording.findings.insert(recording.findings.end(), judged->begin(), judged->end());
  recording.files.push_back({path, table->sha256(), table->rows()});
  Result<void> fed;
  for (auto at = averaging.second_means().begin(); fed && at != averaging.second_means().end(); ++at)
    fed = feed.push(*at, false);
  feed.finish();
  if (options.table.announce) {
    std::string line = table->understood();
    for (const Severity severity : {Severity::kRemark, Severity::kQuestion}) {
      for (const std::string& text : lines_of(recording.findings, severity)) line += "; " + text;
    }
    options.table.announce(line);
  }
  return fed;
}

}  // namespace prism::recordings
