// SPDX-License-Identifier: MIT
// Rows as the JSON of the socket.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/log_columns.hpp"

namespace prism::compensation {
namespace {

struct SampleMember {
  std::string_view key;
  int decimals;
  double (*value)(const Compensated& row);
};

constexpr std::string_view kTimeKey = "{\"time_s\":", kQualityKey = ",\"quality\":\"", kSampleEnd = "\"}",
                           kUnknownJson = "null";
constexpr std::array kSampleMembers = {
    SampleMember{",\"rate_deg_per_h\":", kRateDecimals, [](const Compensated& r) { return r.sample.rate_deg_per_h; }},
    SampleMember{",\"temperature_degc\":", kTemperatureDecimals,
                 [](const Compensated& r) { return r.sample.temperature_degc; }},
    SampleMember{",\"uhfo_v\":", kUhfoDecimals, [](const Compensated& r) { return r.sample.uhfo_v; }},
    SampleMember{",\"bias_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.correction.bias_deg_per_h; }},
    SampleMember{",\"sd_deg_per_h\":", kRateDecimals, [](const Compensated& r) { return r.correction.sd_deg_per_h; }},
    SampleMember{",\"sd_mean_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.correction.sd_mean_deg_per_h; }},
    SampleMember{",\"corrected_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.corrected_deg_per_h; }}};

constexpr std::size_t most_sample_chars() {
  std::size_t chars = kTimeKey.size() + kNumberChars + kQualityKey.size() + kQualityChars + kSampleEnd.size();
  for (const SampleMember& member : kSampleMembers) chars += member.key.size() + kNumberChars;
  return chars;
}
static_assert(most_sample_chars() <= kJsonChars);

// One JSON object, built in place: growing a std::string costs more per frame than its numbers.
class JsonWriter {
 public:
  explicit JsonWriter(char* at) : end_(at) {}
  void put(std::string_view text) { end_ = std::copy_n(text.data(), text.size(), end_); }
  void member(const SampleMember& member, const Compensated& row) {
    put(member.key);
    const double value = member.value(row);
    if (std::isfinite(value)) {
      end_ = put_fixed(end_, value, member.decimals);
    } else {
      put(kUnknownJson);
    }
  }
  // Seconds with microseconds; fixed decimals would be limited by the double's last digits.
  void time(std::int64_t time_ns) {
    if (time_ns < 0 && time_ns > -kNanosecondsPerSecond) put("-");
    end_ = put_integer(end_, time_ns / kNanosecondsPerSecond);
    char* digit = end_ + 7;
    for (std::int64_t rest = std::abs(time_ns % kNanosecondsPerSecond) / 1000; digit > end_ + 1; rest /= 10) {
      *--digit = static_cast<char>('0' + rest % 10);
    }
    *end_ = '.';
    end_ += 7;
  }
  void quality(std::uint32_t quality) { end_ = put_quality(end_, quality); }
  char* end() const { return end_; }

 private:
  char* end_;
};

// Appends to an object that is already closed; sensor names need no escaping.
void append_sensors(std::string& text, const SecondMean& second_mean) {
  if (!second_mean.sensor_list) return;
  text.back() = ',';
  text += "\"sensors\":{";
  for (std::size_t i = 0; i < second_mean.sensor_list->size(); ++i) {
    if (i > 0) text += ',';
    text += '"' + (*second_mean.sensor_list)[i].name + "\":";
    const double value = i < second_mean.sensors.size() ? second_mean.sensors[i] : kUnknown;
    if (std::isfinite(value)) {
      append_fixed(text, value, kSensorDecimals);
    } else {
      text += "null";
    }
  }
  text += "}}";
}

}  // namespace

char* put_json(char* at, const Compensated& row) {
  JsonWriter line(at);
  line.put(kTimeKey);
  line.time(row.sample.time_ns);
  [&]<std::size_t... i>(std::index_sequence<i...>) { (line.member(kSampleMembers[i], row), ...); }
  (std::make_index_sequence<kSampleMembers.size()>());
  line.put(kQualityKey);
  line.quality(row.correction.quality);
  line.put(kSampleEnd);
  return line.end();
}

void append_json(std::string& text, const Compensated& row) {
  char json[kJsonChars];
  text.append(json, static_cast<std::size_t>(put_json(json, row) - json));
}

void append_json(std::string& text, const CompensatedWindow& row) {
  text.reserve(text.size() + kJsonChars);
  for (const std::size_t i : kJsonColumns) {
    const LogColumn& column = kLogColumns[i];
    const bool quoted = column.type == ColumnType::kText;
    text += column.json == 1 ? "{\"" : ",\"";
    (text += column.name) += quoted ? "\":\"" : "\":";
    const std::size_t begin = text.size();
    column.append(text, row);
    if (text.size() == begin) text += kUnknownJson;
    if (quoted) text += '"';
  }
  text += '}';
  append_sensors(text, row.window.second_mean);
}

}  // namespace prism::compensation
