// SPDX-License-Identifier: MIT
#include "compensation/compensated_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "compensation/plain_text.hpp"
#include "compensation/text_number.hpp"

namespace prism {
namespace {

constexpr int kRateDecimals = 6, kTemperatureDecimals = 5, kUhfoDecimals = 6, kSlopeDecimals = 8;
constexpr std::int64_t kFarthestSecond = 9'223'372'036;  // what std::int64_t nanoseconds reach

// How one column of the log is written and read; the table below is the format.
struct Column {
  const char* name;
  void (*append)(std::string& text, const CompensatedWindow& row);
  bool (*parse)(std::string_view field, CompensatedWindow& row);
};

bool parse_integer(std::string_view field, auto& value) {
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc() && end == field.data() + field.size();
}

// An empty field is an unknown quantity; "nan" and "inf", which from_chars would take, are not numbers of a log.
bool parse_real(std::string_view field, double& value) {
  if (field.empty()) return true;
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

// time_utc and time_s are the end of the second: the time up to which the row's data reach.
const std::array kColumns = {
    Column{"time_utc",
           [](std::string& text, const CompensatedWindow& row) { text += utc_text(row.window.bucket.second + 1); },
           [](std::string_view, CompensatedWindow&) { return true; }},
    Column{"time_s",
           [](std::string& text, const CompensatedWindow& row) { append_integer(text, row.window.bucket.second + 1); },
           [](std::string_view field, CompensatedWindow& row) {
             std::int64_t end_s = 0;
             const bool good = parse_integer(field, end_s) && end_s >= -kFarthestSecond && end_s <= kFarthestSecond;
             if (good) row.window.bucket.second = end_s - 1;
             return good;
           }},
    PRISM_INTEGER("samples", window.bucket.samples),
    PRISM_INTEGER("missing", window.bucket.missing_frames),
    PRISM_REAL("rate_deg_per_h", window.bucket.rate_deg_per_h, kRateDecimals),
    PRISM_REAL("temperature_degc", window.bucket.temperature_degc, kTemperatureDecimals),
    PRISM_REAL("uhfo_v", window.bucket.uhfo_v, kUhfoDecimals),
    PRISM_INTEGER("status", window.bucket.status),
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
             row.correction.quality = parse_quality(std::string(field));
             return quality_text(row.correction.quality) == field;  // a torn or unknown name must not read as "good"
           }},
};

#undef PRISM_REAL
#undef PRISM_INTEGER

void append_member(std::string& text, const char* key, double value, int decimals) {
  text += key;
  std::isfinite(value) ? append_fixed(text, value, decimals) : void(text += "null");
}

void append_correction(std::string& text, const Correction& correction, double corrected) {
  append_member(text, ",\"bias_deg_per_h\":", correction.bias_deg_per_h, kRateDecimals);
  append_member(text, ",\"sd_deg_per_h\":", correction.sd_deg_per_h, kRateDecimals);
  append_member(text, ",\"corrected_deg_per_h\":", corrected, kRateDecimals);
  text += ",\"quality\":\"";
  correction.quality == kGood ? void(text += "good") : void(text += quality_text(correction.quality));
  text += "\"}";
}

// Seconds with microseconds; append_fixed would round the large number through a double's last digits.
void append_time(std::string& text, std::int64_t time_ns) {
  if (time_ns < 0 && time_ns > -kNanosecondsPerSecond) text += '-';
  append_integer(text, time_ns / kNanosecondsPerSecond);
  const std::int64_t micros = std::abs(time_ns % kNanosecondsPerSecond) / 1000;
  char digits[7] = {'.', '0', '0', '0', '0', '0', '0'};
  for (std::int64_t rest = micros, i = 6; rest > 0; rest /= 10, --i) digits[i] = static_cast<char>('0' + rest % 10);
  text.append(digits, sizeof digits);
}

}  // namespace

std::string_view csv_columns() {
  static const std::string kLine = [] {
    std::string line;
    for (const Column& column : kColumns) line += (line.empty() ? "" : ",") + std::string(column.name);
    return line;
  }();
  return kLine;
}

void append_csv(std::string& text, const CompensatedWindow& row) {
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    if (i > 0) text += ',';
    kColumns[i].append(text, row);
  }
  text += '\n';
}

Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  CompensatedWindow row;
  std::size_t begin = 0, count = 0;
  for (;; ++count) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view field = line.substr(begin, end - begin);
    if (count < kColumns.size() && !kColumns[count].parse(field, row)) {
      return refuse(std::string(where),
                    fmt::format("column {}: \"{}\" is not a value", kColumns[count].name, plain_text(field)));
    }
    if (end == line.size()) break;
    begin = end + 1;
  }
  if (count + 1 != kColumns.size()) {
    return refuse(std::string(where), fmt::format("found {} columns, expected {}", count + 1, kColumns.size()));
  }
  const Window& window = row.window;
  const bool ready = std::isfinite(window.slope_degc_per_s) && std::isfinite(window.temperature_degc) &&
                     std::isfinite(window.rate_deg_per_h);
  row.window.state = ready ? WindowState::kReady : WindowState::kWarming;
  return row;
}

void append_json(std::string& text, const Compensated& row) {
  text += "{\"time_s\":";
  append_time(text, row.sample.time_ns);
  append_member(text, ",\"rate_deg_per_h\":", row.sample.rate_deg_per_h, kRateDecimals);
  append_member(text, ",\"temperature_degc\":", row.sample.temperature_degc, kTemperatureDecimals);
  append_member(text, ",\"uhfo_v\":", row.sample.uhfo_v, kUhfoDecimals);
  append_correction(text, row.correction, row.corrected_deg_per_h);
}

void append_json(std::string& text, const CompensatedWindow& row) {
  const Window& window = row.window;
  text += "{\"time_s\":";
  append_integer(text, window.bucket.second + 1);
  text += ",\"samples\":";
  append_integer(text, window.bucket.samples);
  text += ",\"missing\":";
  append_integer(text, window.bucket.missing_frames);
  append_member(text, ",\"rate_deg_per_h\":", window.bucket.rate_deg_per_h, kRateDecimals);
  append_member(text, ",\"mean_rate_deg_per_h\":", window.rate_deg_per_h, kRateDecimals);
  append_member(text, ",\"mean_temperature_degc\":", window.temperature_degc, kTemperatureDecimals);
  append_member(text, ",\"slope_degc_per_s\":", window.slope_degc_per_s, kSlopeDecimals);
  append_member(text, ",\"mean_uhfo_v\":", window.uhfo_v, kUhfoDecimals);
  append_member(text, ",\"corrected_mean_deg_per_h\":", row.corrected_mean_deg_per_h, kRateDecimals);
  append_correction(text, row.correction, row.corrected_deg_per_h);
}

}  // namespace prism
