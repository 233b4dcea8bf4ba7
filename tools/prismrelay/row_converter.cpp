// SPDX-License-Identifier: MIT
#include "tools/prismrelay/row_converter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>

#include "base/escape.hpp"
#include "compensation/sensors.hpp"

namespace prism::prismrelay {
namespace {

enum class Kind { kReal, kBig, kInteger, kSmall, kWord };

struct Column {
  const char* name;
  Kind kind;
};

// As the log names them and the table does, too; the times go before them. prism.rows' types are schema.sql's.
constexpr std::array kColumns = {
    Column{"samples", Kind::kInteger},
    Column{"missing", Kind::kBig},
    Column{"rate_deg_per_h", Kind::kReal},
    Column{"temperature_degc", Kind::kReal},
    Column{"uhfo_v", Kind::kReal},
    Column{"status", Kind::kBig},
    Column{"mean_rate_deg_per_h", Kind::kReal},
    Column{"mean_temperature_degc", Kind::kReal},
    Column{"slope_degc_per_s", Kind::kReal},
    Column{"mean_uhfo_v", Kind::kReal},
    Column{"bias_deg_per_h", Kind::kReal},
    Column{"sd_deg_per_h", Kind::kReal},
    Column{"corrected_deg_per_h", Kind::kReal},
    Column{"corrected_mean_deg_per_h", Kind::kReal},
    Column{"quality", Kind::kWord},
    Column{"sd_mean_deg_per_h", Kind::kReal},
    Column{"partial", Kind::kSmall},
};
constexpr std::size_t kTime = kColumns.size(), kArrival = kColumns.size() + 1, kAll = kColumns.size() + 2;
constexpr double kLatest_s = 9.2e9;  // the year 2261
constexpr std::int64_t kDay_s = 86400;

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

bool real(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

bool integer(std::string_view text, std::int64_t most) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && value >= -most && value <= most;
}

bool word(std::string_view text) {
  return text.size() <= 200 && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || c == '_' || c == '+';
         });
}

bool fits(Kind kind, std::string_view text) {
  double value = 0;
  switch (kind) {
    case Kind::kReal:
      return real(text, value);
    case Kind::kBig:
      return integer(text, INT64_MAX);
    case Kind::kInteger:
      return integer(text, INT32_MAX);
    case Kind::kSmall:
      return integer(text, INT16_MAX);
    case Kind::kWord:
      return word(text);
  }
  return false;
}

bool is_sensor(std::string_view name) {
  const bool plain = std::all_of(name.begin(), name.end(),
                                 [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '.'; });
  return plain && sensor_of_column(name);
}

std::string shown(std::string_view text) { return "\"" + shortened(text, 40) + "\""; }

}  // namespace

RowConverter::RowConverter(std::string_view columns) {
  static_assert(kAll <= std::extent_v<decltype(known_)>);
  std::fill(std::begin(known_), std::end(known_), -1);
  const auto names = split(columns);
  fields_ = names.size();
  sensors_.resize(fields_);
  for (std::size_t i = 0; i < fields_; ++i) {
    const auto own =
        std::find_if(kColumns.begin(), kColumns.end(), [&](const Column& c) { return c.name == names[i]; });
    if (own != kColumns.end()) {
      known_[own - kColumns.begin()] = static_cast<int>(i);
    } else if (names[i] == "time_s") {
      known_[kTime] = static_cast<int>(i);
    } else if (names[i] == "arrival_s") {
      known_[kArrival] = static_cast<int>(i);
    } else if (is_sensor(names[i])) {
      sensors_[i] = names[i];
    }
  }
}

std::string RowConverter::copy_columns() {
  std::string text = "gyro, axis, log, segment, row_number, arrival_s, time_s, sensors";
  for (const Column& column : kColumns) (text += ", ") += column.name;
  return text;
}

std::string RowConverter::append(std::string& csv, const RowPosition& place, std::string_view line, std::int64_t& day,
                                 double& arrival_s) const {
  const auto fields = split(line);
  if (fields.size() != fields_) return fmt::format("found {} fields, expected {}", fields.size(), fields_);
  const auto at = [&](std::size_t column) { return known_[column] < 0 ? std::string_view() : fields[known_[column]]; };
  double time_s = 0;
  if (!real(at(kTime), time_s) || std::abs(time_s) > kLatest_s) return "time_s: found " + shown(at(kTime));
  arrival_s = time_s;  // logs of before there was a column
  if (!at(kArrival).empty() && !real(at(kArrival), arrival_s)) return "arrival_s: found " + shown(at(kArrival));
  if (!(arrival_s >= 0 && arrival_s < kLatest_s)) return "arrival_s: found " + shown(at(kArrival));
  for (std::size_t c = 0; c < kColumns.size(); ++c) {
    if (!at(c).empty() && !fits(kColumns[c].kind, at(c)))
      return fmt::format("{}: found {}", kColumns[c].name, shown(at(c)));
  }
  std::string sensors;
  for (std::size_t i = 0; i < fields_; ++i) {
    double value = 0;
    if (sensors_[i].empty() || fields[i].empty()) continue;
    if (!real(fields[i], value)) return fmt::format("{}: found {}", sensors_[i], shown(fields[i]));
    // As a number of JSON: 5 and -0.5, never .5 or +5.
    fmt::format_to(std::back_inserter(sensors), "{}\"\"{}\"\":{}", sensors.empty() ? "" : ",", sensors_[i], value);
  }
  day = std::llround(arrival_s * 1e6) / (kDay_s * 1'000'000);  // to_timestamp() rounds to microseconds
  csv += place.prefix;
  fmt::format_to(std::back_inserter(csv), "{},{},{},{},", place.segment, place.row,
                 at(kArrival).empty() ? at(kTime) : at(kArrival), at(kTime));
  if (!sensors.empty()) ((csv += "\"{") += sensors) += "}\"";
  for (std::size_t c = 0; c < kColumns.size(); ++c) (csv += ',') += at(c);
  csv += '\n';
  return "";
}

}  // namespace prism::prismrelay
