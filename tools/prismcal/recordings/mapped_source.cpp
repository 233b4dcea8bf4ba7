// SPDX-License-Identifier: MIT
// Reads any CSV as a recording: columns are mapped by name and unit, rows become samples for SecondAverager.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "compensation/second_averager.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"
#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/recordings/units.hpp"

namespace prism::recordings {
namespace {

struct MappedColumn {
  std::string column;
  const Unit* unit;
  double scale = 1, offset = 0;  ///< file value · scale + offset is in `unit`
};
using Map = std::map<std::string, MappedColumn>;

constexpr const char* kGrammar =
    "QUANTITY=COLUMN:UNIT[*SCALE][+OFFSET], as rate=rate_x:deg/s or rate=Gx:deg/s*0.061-1.2";

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

Result<Map> parse_map(const std::vector<std::string>& entries) {
  Map map;
  for (const std::string& entry : entries) {
    const std::size_t equals = entry.find('='), colon = entry.rfind(':');
    if (equals == std::string::npos || colon == std::string::npos || colon < equals) {
      return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    }
    const std::size_t scale_at = entry.find_first_of("*+-", colon);  // not in any unit name
    const std::string quantity = entry.substr(0, equals), unit = entry.substr(colon + 1, scale_at - colon - 1);
    const Unit* found = find_unit(quantity, unit);
    if (!found) {
      std::string known;
      for (const Unit& u : kUnits) known += fmt::format("{}{} in {}", known.empty() ? "" : ", ", u.quantity, u.name);
      return make_error("--map", fmt::format("found {} in \"{}\", expected one of: {}", quantity, unit, known));
    }
    MappedColumn mapped{entry.substr(equals + 1, colon - equals - 1), found};
    if (scale_at != std::string::npos && !read_scale_and_offset(std::string_view(entry).substr(scale_at), mapped))
      return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    if (!map.emplace(quantity, std::move(mapped)).second) {
      return make_error("--map", "found " + quantity + " twice, expected it once");
    }
  }
  if (!map.contains("rate")) return make_error("--map", "found no rate, expected rate=COLUMN:UNIT");
  return map;
}

Result<std::vector<double>> converted(const CsvTable& table, const Map& map, const std::string& quantity) {
  const auto at = map.find(quantity);
  if (at == map.end()) return std::vector<double>(table.rows(), kUnknown);
  auto values = table.column(at->second.column);
  if (!values) return values;
  const MappedColumn& mapped = at->second;
  for (double& value : *values)
    value = (value * mapped.scale + mapped.offset) * mapped.unit->factor + mapped.unit->offset;
  return values;
}

}  // namespace

Result<Recording> read_mapped(const std::string& path, const SourceOptions& options) {
  const auto map = parse_map(options.map);
  if (!map) return tl::unexpected<Error>(map.error());
  const auto table = CsvTable::read(path);
  if (!table) return tl::unexpected<Error>(table.error());
  const auto rate = converted(*table, *map, "rate"), temperature = converted(*table, *map, "temperature");
  const auto uhfo = converted(*table, *map, "uhfo"), time = converted(*table, *map, "time");
  for (const auto* column : {&rate, &temperature, &uhfo, &time}) {
    if (!*column) return tl::unexpected<Error>(column->error());
  }
  const bool timed = map->contains("time");
  if (!timed && !(options.interval_s > 0))
    return make_error(path, "found no time, expected --map time=COLUMN:UNIT or --interval SECONDS");
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  recording.files.push_back({path, table->sha256(), table->rows()});
  compensation::SecondAverager averager;
  for (std::size_t i = 0; i < table->rows(); ++i) {
    const double now = timed ? (*time)[i] : static_cast<double>(i + 1) * options.interval_s;
    const double before = timed ? (i > 0               ? (*time)[i - 1]
                                   : table->rows() > 1 ? now - ((*time)[1] - now)
                                                       : now - 1)
                                : now - options.interval_s;
    if (!(now > before))
      return make_error(fmt::format("{}, row {}", path, i + 1),
                        fmt::format("found time {} after {}, expected increasing times", now, before));
    Sample sample;
    sample.time_ns = std::llround(now * 1e9);
    sample.interval_s = now - before;
    sample.rate_deg_per_h = (*rate)[i];
    sample.temperature_degc = (*temperature)[i];
    sample.uhfo_v = (*uhfo)[i];
    if (const auto second_mean = averager.push(sample)) recording.second_means.push_back(*second_mean);
  }
  if (const auto second_mean = averager.finish()) recording.second_means.push_back(*second_mean);
  return recording;
}

}  // namespace prism::recordings
