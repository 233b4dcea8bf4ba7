// SPDX-License-Identifier: MIT
#include "daemon/socket/config_answer.hpp"

#include <optional>

#include "daemon/socket/answer_json.hpp"

namespace prism::socket {
namespace {

using nlohmann::ordered_json;

// Null: not checked.
ordered_json limits_json(const compensation::SensorLimits& limits, const char* range, double unit, const char* slope) {
  ordered_json json = {{range, {known(limits.low / unit), known(limits.high / unit)}}};
  if (slope != nullptr) json[slope] = known(limits.greatest_slope_per_s);
  json["stuck_s"] = known(limits.stuck_s);
  return json;
}

ordered_json plausibility_json(const compensation::PlausibilityLimits& limits) {
  return {{"rate", limits_json(limits.rate, "range_deg_per_s", kDegPerSInDegPerH, nullptr)},
          {"temperature", limits_json(limits.temperature, "range_degc", 1, "greatest_slope_degc_per_s")},
          {"uhfo", limits_json(limits.uhfo, "range_v", 1, nullptr)}};
}

// deg/h per second; null: not limited, or no model.
ordered_json slew_json(const pipeline::Setup::Axis& axis) {
  if (!axis.model) return nullptr;
  return known(
      compensation::greatest_slew_deg_per_h_per_s(*axis.model, axis.engine.slew, axis.engine.max_bias_deg_per_h));
}

// The configured correction of an axis.
void put_correction(ordered_json& json, const pipeline::Setup& setup, std::size_t axis) {
  const config::AxisConfig& config = setup.config.axes[axis];
  json["model"] = config.model;
  json["fallback_model"] = config.fallback_model;
  json["max_bias_deg_per_h"] = config.engine.max_bias_deg_per_h;
  json["max_slew_deg_per_h_per_s"] = slew_json(setup.axes[axis]);
}

// Every key in force; null: nothing is written.
ordered_json segments_json(const std::optional<config::LogSegmentSettings>& settings) {
  constexpr double kMiB = 1 << 20, kHour = 3600;
  if (!settings) return nullptr;
  const bool unlimited = settings->keep_bytes >= config::kNoByteLimit;
  return {{"directory", settings->directory},
          {"segment_mib", static_cast<double>(settings->max_bytes) / kMiB},
          {"segment_hours", static_cast<double>(settings->max_age_s) / kHour},
          {"keep_mib", unlimited ? ordered_json() : ordered_json(static_cast<double>(settings->keep_bytes) / kMiB)},
          {"keep_days", settings->keep_days},
          {"keep_for", settings->keep_for},
          {"when_full", settings->delete_when_full ? "delete_oldest" : "stop"}};
}

}  // namespace

ordered_json config_answer(const Sources& sources) {
  const pipeline::Setup& setup = sources.acquisition.setup();
  const config::Config& c = setup.config;
  ordered_json json = {{"file", c.path}, {"name", c.name}};
  json["gyro"] = {{"serial", c.gyro_serial}};
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    ordered_json& axis = json["axes"][setup.frames->axes[i].name];
    axis["sign"] = c.axes[i].sign;
    axis["unit_scale"] = setup.frames->axes[i].scale;
    if (!c.axes[i].thermometer.empty()) axis["temperature"] = c.axes[i].thermometer;
    put_correction(axis, setup, i);
  }
  json["line"] = {{"device", c.line.device},
                  {"baud", setup.line.format.baud},
                  {"data_bits", setup.line.format.data_bits},
                  {"stop_bits", setup.line.format.stop_bits},
                  {"silence_s", c.line.silence_s},
                  {"retry_min_s", c.line.retry_min_s},
                  {"retry_max_s", c.line.retry_max_s}};
  for (std::size_t i = 0; i < setup.sensor_lines.size(); ++i) {
    const config::SensorLineConfig& own = c.sensor_lines[i];
    json["sensor_lines"][own.name] = {{"device", own.line.device},
                                      {"baud", setup.sensor_lines[i].line.format.baud},
                                      {"frames", own.frames},
                                      {"stale_after_s", own.stale_after_s},
                                      {"silence_s", own.line.silence_s}};
  }
  json["frames"] = {
      {"file", c.frames}, {"name", setup.frames->name}, {"id", setup.frames->id}, {"rate_hz", setup.frames->rate_hz}};
  json["clock"] = c.device_clock ? "device" : "host";
  json["plausibility"] = plausibility_json(setup.axes.front().engine.plausibility);
  json["log"] = segments_json(c.log);
  json["capture"] = segments_json(c.capture);
  json["socket"] = c.socket.path;
  return json;
}

}  // namespace prism::socket
