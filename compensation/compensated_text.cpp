// SPDX-License-Identifier: MIT
#include "compensation/compensated_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <set>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"

namespace prism::compensation {
namespace {

constexpr std::int64_t kFarthestSecond = 9'223'372'036;  // the range of std::int64_t nanoseconds

// Writes and reads one column of the log; the table below defines the format.
struct Column {
  const char* name;
  void (*append)(std::string& text, const CompensatedWindow& row);
  bool (*parse)(std::string_view field, CompensatedWindow& row);
};

bool parse_integer(std::string_view field, auto& value) {
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc() && end == field.data() + field.size();
}

/// The number of a field of digits and one point, as logs have them: the quotient of two integers below 2^53 is rounded
/// once, as from_chars() does, and takes a third of its time. Returns false for other fields.
bool parse_decimals(std::string_view field, double& value) {
  constexpr std::array kPowers = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = field.starts_with('-');
  if (negative) field.remove_prefix(1);
  if (field.size() < 3 || field.size() > 16 || field.front() == '.' || field.back() == '.') return false;
  std::uint64_t digits = 0;
  std::size_t point = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const auto digit = static_cast<unsigned>(field[i] - '0');
    if (digit < 10) {
      digits = 10 * digits + digit;
    } else if (field[i] == '.' && point == 0) {
      point = i;
    } else {
      return false;
    }
  }
  if (point == 0) return false;
  const double number = static_cast<double>(digits) / kPowers[field.size() - 1 - point];
  value = negative ? -number : number;
  return true;
}

// An empty field is an unknown quantity. A log contains no "nan" or "inf", which from_chars would accept.
bool parse_real(std::string_view field, double& value) {
  if (field.empty() || parse_decimals(field, value)) return true;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc() && end == field.data() + field.size() && std::isfinite(value);
}

#define PRISM_REAL(name, member, decimals)                                                                   \
  Column {                                                                                                   \
    name, [](std::string& text, const CompensatedWindow& row) { append_fixed(text, row.member, decimals); }, \
        [](std::string_view field, CompensatedWindow& row) { return parse_real(field, row.member); }         \
  }
#define PRISM_INTEGER(name, member)                                                                     \
  Column {                                                                                              \
    name, [](std::string& text, const CompensatedWindow& row) { append_integer(text, row.member); },    \
        [](std::string_view field, CompensatedWindow& row) { return parse_integer(field, row.member); } \
  }

// time_utc and time_s are the end of the second: the end of the data in this row.
const std::array kColumns = {
    Column{"time_utc",
           [](std::string& text, const CompensatedWindow& row) { text += utc_text(row.window.second_mean.second + 1); },
           [](std::string_view, CompensatedWindow&) { return true; }},
    Column{"time_s",
           [](std::string& text, const CompensatedWindow& row) {
             append_integer(text, row.window.second_mean.second + 1);
           },
           [](std::string_view field, CompensatedWindow& row) {
             std::int64_t end_s = 0;
             const bool good = parse_integer(field, end_s) && end_s >= -kFarthestSecond && end_s <= kFarthestSecond;
             if (good) row.window.second_mean.second = end_s - 1;
             return good;
           }},
    PRISM_INTEGER("samples", window.second_mean.samples),
    PRISM_INTEGER("missing", window.second_mean.missing_frames),
    PRISM_REAL("rate_deg_per_h", window.second_mean.rate_deg_per_h, kRateDecimals),
    PRISM_REAL("temperature_degc", window.second_mean.temperature_degc, kTemperatureDecimals),
    PRISM_REAL("uhfo_v", window.second_mean.uhfo_v, kUhfoDecimals),
    PRISM_INTEGER("status", window.second_mean.status),
    PRISM_REAL("mean_rate_deg_per_h", window.rate_deg_per_h, kRateDecimals),
    PRISM_REAL("mean_temperature_degc", window.temperature_degc, kTemperatureDecimals),
    PRISM_REAL("slope_degc_per_s", window.slope_degc_per_s, kSlopeDecimals),
    PRISM_REAL("mean_uhfo_v", window.uhfo_v, kUhfoDecimals),
    PRISM_REAL("bias_deg_per_h", correction.bias_deg_per_h, kRateDecimals),
    PRISM_REAL("sd_deg_per_h", correction.sd_deg_per_h, kRateDecimals),
    PRISM_REAL("corrected_deg_per_h", corrected_deg_per_h, kRateDecimals),
    PRISM_REAL("corrected_mean_deg_per_h", corrected_mean_deg_per_h, kRateDecimals),
    Column{"quality",
           [](std::string& text, const CompensatedWindow& row) { text += quality_text(row.correction.quality); },
           [](std::string_view field, CompensatedWindow& row) {
             row.correction.quality = kGood;
             if (field == "good") return true;
             row.correction.quality = parse_quality(std::string(field));
             // The log does not state which quantity was implausible, so the reader uses none of this second.
             if (row.correction.quality & kImplausible)
               row.window.second_mean.implausible = row.window.second_mean.all_implausible = {true, true, true};
             row.window.second_mean.clocks_differ = (row.correction.quality & kClocksDiffer) != 0;
             // A truncated or unknown name must not read as "good".
             return quality_text(row.correction.quality) == field;
           }},
    // Columns after those of format 1 are optional. The last column is one digit, so that a truncated row is always
    // detected.
    PRISM_REAL("sd_mean_deg_per_h", correction.sd_mean_deg_per_h, kRateDecimals),
    Column{"arrival_s",
           [](std::string& text, const CompensatedWindow& row) {
             const std::int64_t whole_ms = row.window.second_mean.arrival_ns / 1'000'000;
             if (whole_ms > 0) text += fmt::format("{}.{:03}", whole_ms / 1000, whole_ms % 1000);
           },
           [](std::string_view field, CompensatedWindow& row) {
             double arrival_s = 0;
             if (!parse_real(field, arrival_s) ||
                 !(arrival_s >= 0 && arrival_s <= static_cast<double>(kFarthestSecond)))
               return false;
             row.window.second_mean.arrival_ns = std::llround(arrival_s * 1e3) * 1'000'000;
             return true;
           }},
    Column{"partial",
           [](std::string& text, const CompensatedWindow& row) { text += row.window.second_mean.partial ? '1' : '0'; },
           [](std::string_view field, CompensatedWindow& row) {
             row.window.second_mean.partial = field == "1";
             return field == "0" || field == "1";
           }},
};
constexpr std::size_t kColumnsOfFormat1 = 17;

#undef PRISM_REAL
#undef PRISM_INTEGER

}  // namespace

std::string csv_columns(const std::vector<SensorName>& sensors) {
  std::string line;
  for (const Column& column : kColumns) {
    if (&column == &kColumns.back()) {
      for (const SensorName& sensor : sensors) line += "," + sensor_column(sensor);
    }
    line += (line.empty() ? "" : ",") + std::string(column.name);
  }
  return line;
}

namespace {
constexpr std::string_view kSensorsKey = "# sensors: ";
}  // namespace

std::string sensors_line(const std::vector<SensorName>& sensors) {
  if (sensors.empty()) return "";
  std::string line(kSensorsKey);
  for (const SensorName& sensor : sensors) line += (&sensor == &sensors.front() ? "" : " ") + sensor_column(sensor);
  return line + "\n";
}

std::vector<SensorName> sensors_in(std::string_view metadata) {
  std::vector<SensorName> sensors;
  const std::size_t at = metadata.find(kSensorsKey);
  if (at == std::string_view::npos) return sensors;
  std::string_view rest = metadata.substr(at + kSensorsKey.size());
  rest = rest.substr(0, rest.find('\n'));
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (auto sensor = sensor_of_column(rest.substr(0, end))) sensors.push_back(std::move(*sensor));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return sensors;
}

void append_csv(std::string& text, const CompensatedWindow& row) {
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (i + 1 == kColumns.size()) {
      for (const double value : row.window.second_mean.sensors) {
        text += ',';
        append_fixed(text, value, kSensorDecimals);
      }
    }
    if (i > 0) text += ',';
    kColumns[i].append(text, row);
  }
  text += '\n';
}

CsvLayout::CsvLayout() : known_(kColumns.size()) { std::iota(known_.begin(), known_.end(), std::size_t{0}); }

Result<CsvLayout> CsvLayout::parse(std::string_view columns, std::string_view where, SensorList sensors) {
  CsvLayout layout;
  std::vector<std::string> wanted;
  if (sensors && sensors->empty()) sensors = nullptr;
  for (const SensorName& sensor : sensors ? *sensors : std::vector<SensorName>())
    wanted.push_back(sensor_column(sensor));
  layout.sensors_ = std::move(sensors);
  layout.known_.clear();
  std::set<std::string_view> names;
  for (std::size_t begin = 0, end = 0; end != columns.size(); begin = end + 1) {
    end = std::min(columns.find(',', begin), columns.size());
    const std::string_view name = columns.substr(begin, end - begin);
    if (!names.insert(name).second)
      return make_error(std::string(where), fmt::format("found column \"{}\" twice", plain_text(name)));
    const auto known =
        std::find_if(kColumns.begin(), kColumns.end(), [name](const Column& column) { return column.name == name; });
    const auto sensor = std::find(wanted.begin(), wanted.end(), name);
    layout.known_.push_back(sensor != wanted.end()    ? kSensors + static_cast<std::size_t>(sensor - wanted.begin())
                            : known == kColumns.end() ? kPassedOver
                                                      : static_cast<std::size_t>(known - kColumns.begin()));
  }
  for (const std::string& column : wanted) {
    if (!names.contains(column))
      return make_error(std::string(where),
                        fmt::format("found no column \"{}\", which the metadata lists", plain_text(column)));
  }
  for (std::size_t i = 0; i < kColumnsOfFormat1; ++i) {
    if (names.contains(kColumns[i].name)) continue;
    return make_error(
        std::string(where),
        fmt::format("not a log of prismd: found no column \"{}\"; prismcal reads any other CSV with --map",
                    kColumns[i].name));
  }
  return layout;
}

Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where, const CsvLayout& layout) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  CompensatedWindow row;
  const std::vector<std::size_t>& known = layout.known_;
  row.window.second_mean.sensor_list = layout.sensors_;
  if (layout.sensors_) row.window.second_mean.sensors.assign(layout.sensors_->size(), kUnknown);
  std::size_t begin = 0, count = 0;
  for (;; ++count) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view field = line.substr(begin, end - begin);
    const bool read = count < known.size() && known[count] != CsvLayout::kPassedOver;
    if (read && known[count] >= CsvLayout::kSensors) {
      if (!parse_real(field, row.window.second_mean.sensors[known[count] - CsvLayout::kSensors]))
        return make_error(std::string(where),
                          fmt::format("sensor: found \"{}\", expected a number", plain_text(field)));
    } else if (read && !kColumns[known[count]].parse(field, row)) {
      return make_error(std::string(where), fmt::format("column {}: found \"{}\", expected a valid value",
                                                        kColumns[known[count]].name, plain_text(field)));
    }
    if (end == line.size()) break;
    begin = end + 1;
  }
  if (count + 1 != known.size()) {
    return make_error(std::string(where), fmt::format("found {} columns, expected {}", count + 1, known.size()));
  }
  const Window& window = row.window;
  const bool ready = std::isfinite(window.slope_degc_per_s) && std::isfinite(window.temperature_degc) &&
                     std::isfinite(window.rate_deg_per_h);
  row.window.state = ready ? WindowState::kReady : WindowState::kWarming;
  return row;
}

}  // namespace prism::compensation
