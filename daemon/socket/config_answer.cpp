// SPDX-License-Identifier: MIT
#include "daemon/socket/config_answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

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
  json["extrapolation"] = compensation::extrapolation_name(config.engine.extrapolation);
  json["slew_limit"] = config.engine.slew.limited;
  json["max_slew_deg_per_h_per_s"] = slew_json(setup.axes[axis]);
}

ordered_json axis_json(const pipeline::Setup& setup, std::size_t axis) {
  const config::AxisConfig& config = setup.config.axes[axis];
  ordered_json json = {{"sign", config.sign}, {"unit_scale", setup.frames->axes[axis].scale}};
  if (!config.thermometer.empty()) json["temperature"] = config.thermometer;
  if (!config.uhfo.empty()) json["uhfo"] = config.uhfo;
  json["elevation_deg"] = config.elevation_deg ? ordered_json(*config.elevation_deg) : ordered_json();
  json["azimuth_deg"] = config.azimuth_deg;
  put_correction(json, setup, axis);
  return json;
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
          {"when_full", settings->delete_when_full ? "delete_oldest" : "stop"}};
}

// {"send": "READ?\r"}, or {"send_hex": "55 AA"} if a byte is not printable.
void put_bytes(ordered_json& json, const char* key, std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const bool is_text =
      std::all_of(bytes.begin(), bytes.end(), [](int c) { return (c >= 0x20 && c <= 0x7e) || c == '\r' || c == '\n'; });
  if (is_text)
    json[key] = std::string(bytes.begin(), bytes.end());
  else
    json[std::string(key) + "_hex"] = fmt::format("{:02X}", fmt::join(bytes, " "));
}

ordered_json steps_json(const std::vector<wire::Command>& steps) {
  ordered_json all = ordered_json::array();
  for (const wire::Command& step : steps) {
    ordered_json& json = all.emplace_back(ordered_json::object());
    put_bytes(json, "send", step.send);
    put_bytes(json, "expect", step.expect);
    json[step.expect.empty() ? "wait_ms" : "within_ms"] = (step.expect.empty() ? step.wait : step.within).count();
  }
  return all;
}

// As configured or described.
void put_commands(ordered_json& json, const wire::Commands& commands) {
  json["start"] = steps_json(commands.start.value_or(std::vector<wire::Command>()));
  json["again_when_silent"] = commands.again_when_silent.value_or(false);
  json["stop"] = steps_json(commands.stop.value_or(std::vector<wire::Command>()));
  json["poll"] = nullptr;
  if (!commands.poll) return;
  json["poll"] = {{"every_ms", commands.poll->every.count()}, {"pause_ms", commands.poll->pause.count()}};
  for (const wire::PollRequest& request : commands.poll->requests) {
    ordered_json& one = json["poll"]["requests"].emplace_back(ordered_json::object());
    put_bytes(one, "send", request.send);
    one["within_ms"] = request.within.count();
  }
}

// Every key in force of a line (0: the gyro's).
ordered_json line_json(const pipeline::Setup& setup, std::size_t number) {
  constexpr const char* kParities[] = {"none", "even", "odd"};
  const config::LineConfig& config = setup.line_config(number);
  const wire::WireFormat& format = setup.line_settings(number).format;
  ordered_json json = {{"device", config.device}};
  if (const transport::Network& network = config.network; !network.type.empty()) {
    ordered_json& place = json[network.type] = {{network.listens ? "listen" : "address", network.address}};
    if (!network.from.empty()) place["from"] = network.from;
  }
  json["baud"] = format.baud;
  json["data_bits"] = format.data_bits;
  json["parity"] = kParities[static_cast<int>(format.parity)];
  json["stop_bits"] = format.stop_bits;
  json["silence_s"] = config.silence_s;
  json["retry_min_s"] = config.retry_min_s;
  json["retry_max_s"] = config.retry_max_s;
  put_commands(json, setup.line_commands(number).with(config.commands));
  json["allow_send"] = config.allow_send;
  return json;
}

void put_columns(ordered_json& json, const TextColumns& text) {
  for (const TextColumn& column : text.columns) {
    json["columns"][column.sensor.name] = {{"column", column.column + 1}, {"unit", column.sensor.unit}};
    if (column.min > TextColumn().min) json["columns"][column.sensor.name]["min"] = column.min;
    if (column.max < TextColumn().max) json["columns"][column.sensor.name]["max"] = column.max;
  }
  json["separators"] = text.separators;
  json["line_end"] = text.ends_with_cr ? "cr" : "lf";
  json["decimal_comma"] = text.decimal_comma;
}

}  // namespace

ordered_json config_answer(const Sources& sources) {
  const pipeline::Setup& setup = sources.device.setup;
  const config::Config& c = setup.config;
  ordered_json json = {{"file", c.path}, {"name", c.name}};
  json["gyro"] = {{"serial", c.gyro_serial}};
  for (std::size_t i = 0; i < setup.axes.size(); ++i) json["axes"][setup.frames->axes[i].name] = axis_json(setup, i);
  json["line"] = line_json(setup, 0);
  for (std::size_t i = 0; i < setup.sensor_lines.size(); ++i) {
    const config::SensorLineConfig& own = c.sensor_lines[i];
    ordered_json& line = json["sensor_lines"][own.name] = line_json(setup, i + 1);
    line["frames"] = own.frames;
    line["stale_after_s"] = own.stale_after_s;
    if (!own.text.columns.empty()) put_columns(line, own.text);
  }
  json["frames"] = {
      {"file", c.frames}, {"name", setup.frames->name}, {"id", setup.frames->id}, {"rate_hz", setup.frames->rate_hz}};
  json["rate_hz"] = setup.frames->rate_hz;
  json["clock"] = c.device_clock ? "device" : "host";
  json["accept_clock"] = c.accept_clock;
  json["site"] = {{"latitude_deg", c.latitude_deg}};
  json["plausibility"] = plausibility_json(setup.axes.front().engine.plausibility);
  json["log"] = segments_json(c.log);
  json["capture"] = segments_json(c.capture);
  json["socket"] = {{"path", c.socket.path},
                    {"mode", fmt::format("{:04o}", c.socket.mode)},
                    {"client_buffer_kib", c.socket.client_buffer_bytes / 1024},
                    {"max_clients", c.socket.max_clients}};
  json["event_level"] = c.event_level;
  return json;
}

}  // namespace prism::socket
