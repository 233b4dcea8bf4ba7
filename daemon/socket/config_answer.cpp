// SPDX-License-Identifier: MIT
#include <optional>
#include <utility>
#include <vector>

#include "config/config_keys.hpp"
#include "daemon/socket/answers.hpp"

namespace prism::socket {
namespace {

// Null: not checked.
SensorStatement statement(const compensation::SensorLimits& limits) {
  return {Range{limits.low, limits.high}, limits.greatest_slope_per_s, limits.stuck_s};
}

// Adds the values of the frame description.
void complete_line(const pipeline::Setup& setup, std::size_t number, config::LineConfig& line) {
  constexpr const char* kParities[] = {"none", "even", "odd"};
  const wire::WireFormat& format = setup.line_settings(number).format;
  line.baud = format.baud;
  line.data_bits = format.data_bits;
  line.parity = kParities[static_cast<int>(format.parity)];
  line.stop_bits = format.stop_bits;
  line.commands = setup.line_commands(number).with(line.commands);
  if (!line.commands.start) line.commands.start.emplace();
  if (!line.commands.stop) line.commands.stop.emplace();
  line.commands.again_when_silent = line.commands.again_when_silent.value_or(false);
}

// The configuration with every value in force, by axes.
config::Config complete(const pipeline::Setup& setup) {
  config::Config config = setup.config;
  config.by_axes = true;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    config::AxisConfig& axis = config.axes[i];
    axis.name = setup.frames->axes[i].name;
    axis.engine.slew.max_slew_deg_per_h_per_s.reset();
    if (const auto& model = setup.axes[i].model) {
      const compensation::CompensationSettings& engine = setup.axes[i].engine;
      axis.engine.slew.max_slew_deg_per_h_per_s =
          compensation::greatest_slew_deg_per_h_per_s(*model, engine.slew, engine.max_bias_deg_per_h);
    }
  }
  complete_line(setup, 0, config.line);
  for (std::size_t i = 0; i < config.sensor_lines.size(); ++i) complete_line(setup, i + 1, config.sensor_lines[i].line);
  config.rate_hz = setup.frames->rate_hz;
  const compensation::PlausibilityLimits& limits = setup.axes.front().engine.plausibility;
  config.plausibility = {statement(limits.rate), statement(limits.temperature), statement(limits.uhfo)};
  return config;
}

}  // namespace

nlohmann::ordered_json config_answer(const Sources& sources) {
  const pipeline::Setup& setup = sources.device.setup;
  nlohmann::ordered_json json = {{"file", setup.config.path}};
  json.update(config::config_keys().print(complete(setup)));
  for (const auto& [key, files] : {std::pair("log", &setup.config.log), std::pair("capture", &setup.config.capture)}) {
    if (*files && (*files)->keep_bytes >= config::kNoByteLimit) json[key]["keep_mib"] = nullptr;
  }
  for (const auto& axis : setup.frames->axes) {
    nlohmann::ordered_json& shown = json["axes"][axis.name];
    shown["unit_scale"] = axis.scale;
    shown.update(shown["correction"]);
    shown.erase("correction");
  }
  json["frames"] = {{"file", setup.config.frames},
                    {"name", setup.frames->name},
                    {"id", setup.frames->id},
                    {"rate_hz", setup.frames->rate_hz}};
  return json;
}

}  // namespace prism::socket
