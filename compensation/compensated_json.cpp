// SPDX-License-Identifier: MIT
// Rows as the JSON of the socket.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"

namespace prism::compensation {
namespace {

// One JSON object, built in place: growing a std::string costs more per frame than its numbers. kJsonChars is above the
// sum of all keys and numbers of the longest object.
class JsonWriter {
 public:
  explicit JsonWriter(char* at) : end_(at) {}
  template <std::size_t size>
  void put(const char (&literal)[size]) {
    end_ = std::copy_n(literal, size - 1, end_);
  }
  void integer(std::int64_t value) { end_ = put_integer(end_, value); }
  template <std::size_t size>
  void member(const char (&key)[size], double value, int decimals) {
    put(key);
    if (std::isfinite(value)) {
      end_ = put_fixed(end_, value, decimals);
    } else {
      put("null");
    }
  }
  // Seconds with microseconds; fixed decimals would be limited by the double's last digits.
  void time(std::int64_t time_ns) {
    if (time_ns < 0 && time_ns > -kNanosecondsPerSecond) put("-");
    integer(time_ns / kNanosecondsPerSecond);
    char* digit = end_ + 7;
    for (std::int64_t rest = std::abs(time_ns % kNanosecondsPerSecond) / 1000; digit > end_ + 1; rest /= 10) {
      *--digit = static_cast<char>('0' + rest % 10);
    }
    *end_ = '.';
    end_ += 7;
  }
  void correction(const Correction& correction, double corrected) {
    member(",\"bias_deg_per_h\":", correction.bias_deg_per_h, kRateDecimals);
    member(",\"sd_deg_per_h\":", correction.sd_deg_per_h, kRateDecimals);
    member(",\"sd_mean_deg_per_h\":", correction.sd_mean_deg_per_h, kRateDecimals);
    member(",\"corrected_deg_per_h\":", corrected, kRateDecimals);
    put(",\"quality\":\"");
    end_ = put_quality(end_, correction.quality);
    put("\"}");
  }
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
  line.put("{\"time_s\":");
  line.time(row.sample.time_ns);
  line.member(",\"rate_deg_per_h\":", row.sample.rate_deg_per_h, kRateDecimals);
  line.member(",\"temperature_degc\":", row.sample.temperature_degc, kTemperatureDecimals);
  line.member(",\"uhfo_v\":", row.sample.uhfo_v, kUhfoDecimals);
  line.correction(row.correction, row.corrected_deg_per_h);
  return line.end();
}

void append_json(std::string& text, const Compensated& row) {
  char json[kJsonChars];
  text.append(json, static_cast<std::size_t>(put_json(json, row) - json));
}

void append_json(std::string& text, const CompensatedWindow& row) {
  const Window& window = row.window;
  char json[kJsonChars];
  JsonWriter line(json);
  line.put("{\"time_s\":");
  line.integer(window.second_mean.second + 1);
  line.put(",\"samples\":");
  line.integer(window.second_mean.samples);
  line.put(",\"missing\":");
  line.integer(window.second_mean.missing_frames);
  line.member(",\"rate_deg_per_h\":", window.second_mean.rate_deg_per_h, kRateDecimals);
  line.member(",\"temperature_degc\":", window.second_mean.temperature_degc, kTemperatureDecimals);
  line.member(",\"uhfo_v\":", window.second_mean.uhfo_v, kUhfoDecimals);
  line.member(",\"mean_rate_deg_per_h\":", window.rate_deg_per_h, kRateDecimals);
  line.member(",\"mean_temperature_degc\":", window.temperature_degc, kTemperatureDecimals);
  line.member(",\"slope_degc_per_s\":", window.slope_degc_per_s, kSlopeDecimals);
  line.member(",\"mean_uhfo_v\":", window.uhfo_v, kUhfoDecimals);
  line.member(",\"corrected_mean_deg_per_h\":", row.corrected_mean_deg_per_h, kRateDecimals);
  line.correction(row.correction, row.corrected_deg_per_h);
  text.append(json, static_cast<std::size_t>(line.end() - json));
  append_sensors(text, window.second_mean);
}

}  // namespace prism::compensation
