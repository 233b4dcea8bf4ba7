// SPDX-License-Identifier: MIT
#include "tools/prismcal/quantity_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "compensation/sensors.hpp"

namespace prism::recordings {
namespace {

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

bool is_quantity(std::string_view name) {
  return std::any_of(std::begin(tables::kUnits), std::end(tables::kUnits),
                     [&](const tables::Unit& unit) { return unit.quantity == name; });
}

/// Units of sensors besides those of temperatures and voltages.
constexpr tables::Unit kOtherUnits[] = {
    {"", "A", 1, 0, ""}, {"", "mA", 1, 0, ""}, {"", "Pa", 1, 0, ""}, {"", "g", 1, 0, ""}};

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

/// The first column of numbers that is one.
template <class Is>
std::optional<std::size_t> column_that(const tables::PlainTable& table, const Is& is) {
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    if (table.kind(i) == tables::ColumnKind::kNumber && is(table.columns()[i])) return i;
  }
  return std::nullopt;
}

/// By its unit.
std::optional<std::size_t> column_of(const tables::PlainTable& table, std::string_view quantity) {
  return column_that(table, [&](const tables::Header& h) { return h.unit && h.unit->quantity == quantity; });
}

std::optional<std::size_t> column_named_uhfo(const tables::PlainTable& table) {
  return column_that(table, [](const tables::Header& h) {
    return !h.unit && tables::lower(h.name).find("uhfo") != std::string::npos;
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

bool is_sensor(const std::string& quantity) {
  return quantity.find('.') != std::string::npos && is_sensor_name(quantity);
}

std::string sensor_unit(const tables::Unit& unit) {
  return unit.quantity == "temperature" ? "degC" : unit.quantity == "uhfo" ? "V" : std::string(unit.name);
}

Result<QuantityMap> parse_map(const std::vector<std::string>& entries) {
  QuantityMap map;
  for (const std::string& entry : entries) {
    const std::size_t equals = entry.find('=');
    if (equals == std::string::npos || equals + 1 == entry.size())
      return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    const std::string quantity = entry.substr(0, equals);
    const std::size_t colon = entry.rfind(':');
    MappedColumn mapped;
    if (colon == std::string::npos || colon < equals) {
      if (!is_quantity(quantity) && !is_sensor(quantity))
        return make_error("--map", fmt::format("found {}, expected one of: {}", quantity, known_units("")));
      mapped.column = entry.substr(equals + 1);
    } else {
      const std::size_t scale_at = entry.find_first_of("*+-", colon);  // not in any unit name
      const std::string unit = entry.substr(colon + 1, scale_at - colon - 1);
      mapped.unit = find_unit(quantity, unit);
      if (!mapped.unit)
        return make_error("--map",
                          fmt::format("found {} in \"{}\", expected {}{}", quantity, unit,
                                      is_quantity(quantity) || is_sensor(quantity) ? "" : "one of: ",
                                      known_units(is_quantity(quantity) || is_sensor(quantity) ? quantity : "")));
      mapped.column = entry.substr(equals + 1, colon - equals - 1);
      mapped.is_scaled = scale_at != std::string::npos;
      if (scale_at != std::string::npos && !read_scale_and_offset(std::string_view(entry).substr(scale_at), mapped))
        return make_error("--map", fmt::format("found \"{}\", expected {}", entry, kGrammar));
    }
    if (!map.emplace(quantity, std::move(mapped)).second)
      return make_error("--map", "found " + quantity + " twice, expected it once");
  }
  if (!map.contains("rate")) return make_error("--map", "found no rate, expected rate=COLUMN:UNIT");
  return map;
}

// A unit at the end of a name may be a part of the name, so it counts only for the same quantity.
static bool contradicts(const tables::Header& header, const tables::Unit& unit) {
  if (!header.unit || (!header.stated && header.unit->quantity != unit.quantity)) return false;
  return header.unit->quantity != unit.quantity || header.unit->factor != unit.factor ||
         header.unit->offset != unit.offset;
}

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
  text += std::string(" ") + kSiteOptions;
  if (!inputs.empty()) text += " --inputs " + inputs.substr(1);
  return text + " --out model.json";
}

}  // namespace prism::recordings
