// SPDX-License-Identifier: MIT
#include "daemon/pipeline/setup.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include "compensation/compensated_text.hpp"
#include "compensation/model_text.hpp"
#include "config/search_path.hpp"
#include "config/version.hpp"
#include "drivers/transport/network_line.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::pipeline {
namespace {

// The line's own settings instead of those of `wire`.
wire::WireFormat wire_format(const config::LineConfig& line, wire::WireFormat wire) {
  wire.baud = line.baud.value_or(wire.baud);
  wire.data_bits = line.data_bits.value_or(wire.data_bits);
  wire.stop_bits = line.stop_bits.value_or(wire.stop_bits);
  wire.parity = line.parity.value_or(wire.parity);
  return wire;
}

// Reads the description and runs its test vectors. `place`: where its name was given, for errors. Its wire format is
// that of `line`, not the suggested one, since time stamps subtract the transmission time of a byte.
Result<wire::FrameDescriptionPtr> load_frames(const std::string& path, const std::string& place,
                                              wire::GyroChoice choice, const config::LineConfig& line) {
  choice.baud = line.baud;
  choice.network = !line.network.type.empty();
  const Result<std::string> text = config::read_data_file(path, "frames", place);
  if (!text) return tl::unexpected<Error>(text.error());
  Result<wire::FrameDescriptionPtr> frames = wire::parse_frame_description(*text, path, choice);
  if (!frames) return frames;
  if (auto proved = wire::run_test_vectors(**frames); !proved) return tl::unexpected<Error>(proved.error());
  auto effective = std::make_shared<wire::FrameDescription>(**frames);
  effective->wire = wire_format(line, effective->wire);
  effective->commands = effective->commands.with(line.commands);
  if (effective->commands.poll && line.network.type == "udp") {
    const auto to = transport::parse_numeric_endpoint(line.network.from);
    if (!to || to->port == 0)
      return make_error(place,
                        "its poll has nowhere to go: expected \"udp\": {\"from\": \"ADDRESS:PORT\"} of the device");
  }
  return wire::FrameDescriptionPtr(std::move(effective));
}

transport::Settings line_settings(const config::LineConfig& line, const wire::FrameDescription& frames) {
  transport::Settings settings{line.device, wire_format(line, frames.wire)};
  settings.network = line.network;
  return settings;
}

/// The frames of the gyro's line, or those of `output`, whose numbers have the sign and scale of their description.
Result<wire::FrameDescriptionPtr> load_gyro_frames(const config::Config& config, const std::string& place,
                                                   const config::OutputConfig* output = nullptr) {
  wire::GyroChoice choice;
  choice.axes.clear();
  choice.sensors = config.by_axes;
  if (!output) choice.rate_hz = config.rate_hz;
  for (const config::AxisConfig& axis : config.axes)
    choice.axes.push_back(output ? wire::AxisChoice{axis.name}
                                 : wire::AxisChoice{axis.name, axis.sign, axis.scale_factor_arcsec_per_pulse});
  const std::string& name = output ? output->frames : config.frames;
  Result<wire::FrameDescriptionPtr> frames =
      load_frames(name, place + "/frames", choice, output ? output->line : config.line);
  if (frames && !(*frames)->carries_gyro())
    return make_error(name, "found no gyro, expected one; instruments without a gyro belong to \"sensor_lines\"");
  return frames;
}

Result<Setup::SensorLine> load_sensor_line(const config::SensorLineConfig& config, const std::string& config_path) {
  wire::GyroChoice choice;
  choice.sensors = true;
  choice.text = config.text;
  const std::string place = fmt::format("{}:/sensor_lines/{}/frames", config_path, config.name);
  const Result<wire::FrameDescriptionPtr> frames = load_frames(config.frames, place, choice, config.line);
  if (!frames) return tl::unexpected<Error>(frames.error());
  if ((*frames)->carries_gyro())
    return make_error(
        config.frames,
        fmt::format("found a gyro, expected an instrument without a gyro for the sensor line {}", config.name));
  if ((*frames)->sensors().empty())
    return make_error(
        config.frames,
        fmt::format(
            "found no sensor with a name, expected at least one; name them in \"columns\" of the sensor line {}",
            config.name));
  return Setup::SensorLine{config.name, *frames, line_settings(config.line, **frames), config.stale_after_s};
}

/// The device's sensors, then those of each line, named LINE.SENSOR.
SensorList all_sensors(const Setup& setup) {
  std::vector<SensorName> sensors;
  for (const wire::Channel& rule : setup.frames->sensors()) sensors.push_back(rule.sensor);
  for (const Setup::SensorLine& line : setup.sensor_lines) {
    for (const wire::Channel& rule : line.frames->sensors())
      sensors.push_back({line.name + "." + rule.sensor.name, rule.sensor.unit});
  }
  return sensors.empty() ? nullptr : std::make_shared<const std::vector<SensorName>>(std::move(sensors));
}

/// The index of a sensor in this unit; -1: `name` is empty. `where`: the sensor was named there.
Result<int> find_sensor(const Setup& setup, const std::string& where, const std::string& name,
                        const std::string& unit) {
  if (name.empty()) return -1;
  const std::vector<SensorName>& there = sensors_of_list(setup.sensors);
  const std::size_t index = sensor_index(there, name);
  if (index == there.size())
    return make_error(where, fmt::format("found {}, expected a sensor of {}{}: {}", name, setup.frames->name,
                                         setup.config.by_axes ? "" : " (sensors need \"axes\" in the configuration)",
                                         sensors_text(there)));
  if (there[index].unit != unit)
    return make_error(where, fmt::format("found {} in {}, expected a sensor in {}", name, there[index].unit, unit));
  return static_cast<int>(index);
}

// Rejects a model of another gyro or axis, or with inputs that neither the frames nor configured sensors have. `place`:
// where `path` was given.
Result<compensation::ModelPtr> load_model(const Setup& setup, const std::string& axis, const std::string& path,
                                          const std::string& place, const Setup::Axis& sources) {
  const config::Config& config = setup.config;
  const wire::FrameDescription& frames = *setup.frames;
  if (path.empty()) return compensation::ModelPtr();
  const Result<std::string> text = config::read_data_file(path, "models", place);
  if (!text) return tl::unexpected<Error>(text.error());
  Result<compensation::ModelPtr> model = compensation::parse_model(*text, path);
  if (!model) return model;
  const compensation::ModelInfo& info = (*model)->info();
  if (!info.gyro_serial.empty() && !config.gyro_serial.empty() && info.gyro_serial != config.gyro_serial) {
    return make_error(path + ":/gyro/serial",
                      fmt::format("found \"{}\", expected \"{}\" as in {}: the model is of another gyro",
                                  info.gyro_serial, config.gyro_serial, config.path));
  }
  if (!info.gyro_axis.empty() && info.gyro_axis != axis)
    return make_error(path + ":/gyro/axis",
                      fmt::format("found \"{}\", expected \"{}\": the model is of another axis", info.gyro_axis, axis));
  for (const std::string& input : info.inputs) {
    const bool of_sensor = !compensation::sensors_of({input}).empty(), is_uhfo = input == compensation::kInputUhfo;
    const bool own = (is_uhfo ? sources.uhfo : sources.thermometer) >= 0;
    if (of_sensor || own || frames.has(is_uhfo ? wire::ChannelRole::kUhfo : wire::ChannelRole::kTemperature)) continue;
    return make_error(path + ":/inputs",
                      fmt::format("found {}, which frames of \"{}\" do not contain", input, frames.name));
  }
  for (const SensorName& sensor : info.features.sensors) {
    const auto found = find_sensor(setup, path + ":/features/sensors", sensor.name, sensor.unit);
    if (!found) return tl::unexpected<Error>(found.error());
  }
  return model;
}

Result<void> load_models(const Setup& setup, std::size_t index, const Overrides& overrides, Setup::Axis& axis) {
  const config::AxisConfig& config = setup.config.axes[index];
  Setup::Axis sources = axis;
  sources.thermometer = std::max(axis.thermometer, setup.frames->axes[index].thermometer);
  const std::string& name = setup.frames->axes[index].name;
  const std::string keys = setup.config.path + (setup.config.by_axes ? ":/axes/" + config.name : ":");
  const std::string place = overrides.model.empty() ? keys + "/model" : "--model";
  if (auto failed = take(axis.model, load_model(setup, name, config.model, place, sources))) return *failed;
  if (auto failed =
          take(axis.fallback, load_model(setup, name, config.fallback_model, keys + "/fallback_model", sources)))
    return *failed;
  compensation::CompensationEngine trial(axis.engine);
  if (auto taken = trial.use(axis.model, axis.fallback); !taken)
    return make_error(config.fallback_model, taken.error().what);
  return {};
}

// Rules of an output. `place`: of it in the configuration.
Result<void> check_output(const Setup& setup, const Setup::Output& output, const std::string& place) {
  const config::OutputConfig& config = output.config;
  const wire::FrameDescription& from = *setup.frames;
  bool is_marked = true, has_hex = false;
  for (const wire::MessageType& kind : from.kinds) {
    is_marked = is_marked && (!kind.roles.carries_gyro() || !kind.roles.corrected.empty());
    for (const wire::AxisRoles& axis : kind.roles.axes) {
      for (const int index : axis.gyro) {
        const wire::Field& field = kind.fields[static_cast<std::size_t>(index)];
        has_hex = has_hex || field.is_hex() || field.type == wire::NumberType::kHexText;
      }
    }
  }
  if (config.frames == "same" && has_hex)
    return make_error(place + "/frames", fmt::format("rates of {} are hexadecimal digits, which cannot be corrected in "
                                                     "place; expected \"prism\" or a frame description",
                                                     from.name));
  is_marked = config.frames == "prism" || (config.frames == "same" && is_marked);
  if (!config.then_drop && !is_marked && !config.unmarked)
    return make_error(place + "/when_unknown",
                      "raw frames would look like corrected ones, because no bit \"corrected\" is described; expected "
                      "\"drop\", or \"unmarked\": true to accept it");
  if (!output.frames) return {};
  const wire::FrameDescription& to = *output.frames;
  const auto lacks = [&](const std::string& what) {
    return make_error(place + "/frames", fmt::format("{} has {}, which {} does not have", to.name, what, from.name));
  };
  if (to.axes.size() != from.axes.size()) return lacks(fmt::format("{} axes", to.axes.size()));
  if (to.has(wire::ChannelRole::kTemperature) && !from.has(wire::ChannelRole::kTemperature))
    return lacks("a temperature");
  if (to.has(wire::ChannelRole::kUhfo) && !from.has(wire::ChannelRole::kUhfo)) return lacks("a UHFO voltage");
  for (const wire::Channel& rule : to.sensors()) {
    const std::size_t own = sensor_index(sensors_of_list(setup.sensors), rule.sensor.name);  // those of lines follow
    if (own >= from.sensors().size()) return lacks("sensor " + rule.sensor.name);
  }
  return {};
}

Result<void> load_outputs(Setup& setup) {
  for (const config::OutputConfig& config : setup.config.outputs) {
    const std::string place = fmt::format("{}:/out/{}", setup.config.path, setup.outputs.size());
    Setup::Output output{config, nullptr, {}};
    if (config.frames != "same" && config.frames != "prism") {
      if (auto failed = take(output.frames, load_gyro_frames(setup.config, place, &config))) return *failed;
    }
    output.line = line_settings(config.line, output.frames ? *output.frames : *setup.frames);
    if (auto good = check_output(setup, output, place); !good) return good;
    setup.outputs.push_back(std::move(output));
  }
  return {};
}

void leave_out_models(Setup::Axis& axis, const Error& why) {
  axis.model = axis.fallback = nullptr;
  axis.model_problem = why.text();
}

Result<Setup::Axis> load_axis(const Setup& setup, std::size_t index, const Overrides& overrides) {
  const config::AxisConfig& config = setup.config.axes[index];
  Setup::Axis axis;
  const std::string place = fmt::format("{}:/axes/{}", setup.config.path, config.name);
  if (auto failed = take(axis.thermometer, find_sensor(setup, place + "/temperature", config.thermometer, "degC")))
    return *failed;
  if (auto failed = take(axis.uhfo, find_sensor(setup, place + "/uhfo", config.uhfo, "V"))) return *failed;
  axis.engine = config.engine;
  axis.engine.plausibility.take(setup.frames->plausible);
  axis.engine.plausibility.take(setup.config.plausibility);
  auto loaded = load_models(setup, index, overrides, axis);
  if (!loaded && !overrides.tolerate_models) return tl::unexpected<Error>(loaded.error());
  if (!loaded) leave_out_models(axis, loaded.error());
  return axis;
}

/// All models of a device must be of one gyro, even if the configuration names no serial number.
Result<void> check_serials(Setup& setup) {
  std::string path, serial;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    const config::AxisConfig& config = setup.config.axes[i];
    for (const auto& [file, model] :
         {std::pair(config.model, setup.axes[i].model), {config.fallback_model, setup.axes[i].fallback}}) {
      const std::string found = model ? model->info().gyro_serial : "";
      if (found.empty() || found == serial) continue;
      if (!serial.empty()) {
        return make_error(file + ":/gyro/serial",
                          fmt::format("found \"{}\", but {} is of gyro \"{}\"; expected models of the same gyro", found,
                                      path, serial));
      }
      serial = found, path = file;
    }
  }
  if (!serial.empty() && setup.config.gyro_serial.empty()) {
    setup.notes.push_back(fmt::format("{}: is of gyro \"{}\", which cannot be checked because {} has no gyro/serial",
                                      path, serial, setup.config.path));
  }
  return {};
}

Result<void> replace(config::Config& config, const Overrides& overrides) {
  namespace fs = std::filesystem;
  const auto absolute = [](const std::string& path) {
    std::error_code error;
    const fs::path found = fs::absolute(path, error);
    return error ? path : found.string();
  };
  if (!overrides.model.empty()) {
    if (config.axes.size() > 1)
      return make_error("--model",
                        fmt::format("found one model, but {} has {} axes; set the models in the configuration",
                                    config.path, config.axes.size()));
    config.axes.front().model = config::find_data_file(overrides.model, "models", absolute("."));
  }
  for (config::AxisConfig& axis : config.axes) {
    if (overrides.without_models) axis.model.clear(), axis.fallback_model.clear();
  }
  if (!overrides.device.empty()) {
    config.line.device = absolute(overrides.device);
    config.line.network = {};
  }
  if (!overrides.socket.empty()) config.socket.path = absolute(overrides.socket);
  if (overrides.replay_log.empty()) return {};
  config.capture.reset();
  config.log = config.log.value_or(config::LogSegmentSettings{});
  config.log->directory = absolute(overrides.replay_log);
  return {};
}

constexpr double kDayS = 86400;
// A row with a model's columns; a sensor's column; a capture's packet with one frame, without the frame (measured).
constexpr double kRowBytes = 170, kSensorBytes = 10, kPacketBytes = 28;

/// The directory, or the part of its path that exists.
std::filesystem::path existing_part(const std::string& directory) {
  std::error_code error;
  std::filesystem::path place = directory;
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  return place.empty() ? std::filesystem::path(".") : place;
}

}  // namespace

Result<Setup> load_setup(const std::string& config_path, const Overrides& overrides) {
  Setup setup;
  if (auto failed = take(setup.config, config::load_config(config_path))) return *failed;
  if (auto replaced = replace(setup.config, overrides); !replaced) return tl::unexpected<Error>(replaced.error());
  if (auto failed = take(setup.frames, load_gyro_frames(setup.config, setup.config.path + ":"))) return *failed;
  setup.notes = setup.frames->warnings;
  setup.notes.insert(setup.notes.end(), setup.config.warnings.begin(), setup.config.warnings.end());
  for (const config::SensorLineConfig& line : setup.config.sensor_lines) {
    if (auto failed = take(setup.sensor_lines.emplace_back(), load_sensor_line(line, setup.config.path)))
      return *failed;
  }
  setup.sensors = all_sensors(setup);
  for (std::size_t i = 0; i < setup.config.axes.size(); ++i) {
    Setup::Axis axis;
    if (auto failed = take(axis, load_axis(setup, i, overrides))) return *failed;
    setup.axes.push_back(std::move(axis));
  }
  if (auto one = check_serials(setup); !one) {
    if (!overrides.tolerate_models) return tl::unexpected<Error>(one.error());
    for (Setup::Axis& axis : setup.axes) leave_out_models(axis, one.error());
  }
  if (const auto& names = setup.frames->axis_names; names.size() > 1 && setup.config.axes.front().name.empty()) {
    setup.notes.push_back(
        fmt::format("{}: found no \"axis\" or \"axes\"; using {}, the first of {}; use \"axes\" for several",
                    setup.config.path, names.front(), fmt::join(names, ", ")));
  }
  setup.line = line_settings(setup.config.line, *setup.frames);
  if (auto loaded = load_outputs(setup); !loaded) return tl::unexpected<Error>(loaded.error());
  setup.clock.source = setup.config.device_clock ? drivers::ClockSource::kDevice : drivers::ClockSource::kHost;
  setup.clock.check_frame_rate = !(setup.config.accept_clock || overrides.accept_clock);
  setup.clock.max_rate_deg_per_h = 0;
  for (const Setup::Axis& axis : setup.axes) {
    const compensation::SensorLimits& rate = axis.engine.plausibility.rate;
    setup.clock.max_rate_deg_per_h =
        std::max({setup.clock.max_rate_deg_per_h, std::abs(rate.low), std::abs(rate.high)});
    setup.clock.max_difference_s = std::min<double>(setup.clock.max_difference_s, axis.features().max_gap_s);
  }
  return setup;
}

std::string log_metadata(const Setup& setup, std::size_t axis) {
  const config::Config& config = setup.config;
  const config::AxisConfig& mounted = config.axes[axis];
  const Setup::Axis& own = setup.axes[axis];
  const wire::AxisRule& rule = setup.frames->axes[axis];
  const auto model_line = [](const compensation::ModelPtr& model) {
    return model ? fmt::format("{} {}", model->info().id, model->info().name) : std::string("none");
  };
  std::string text = fmt::format("# prism {} data log, format 2\n# instance: {}\n# gyro_serial: {}\n", kVersion,
                                 config.name, config.gyro_serial.empty() ? "unknown" : config.gyro_serial);
  text += fmt::format("# frames: {} {}\n# axis: {}\n# clock: {}\n", setup.frames->name, setup.frames->id, rule.name,
                      config.device_clock ? "device" : "host");
  text += fmt::format("# gyro_unit: {}\n# model: {}\n# fallback_model: {}\n", rule.scale, model_line(own.model),
                      model_line(own.fallback));
  if (mounted.elevation_deg) {
    text += fmt::format("# site: latitude_deg {} elevation_deg {} azimuth_deg {}\n", config.latitude_deg,
                        *mounted.elevation_deg, mounted.azimuth_deg);
  }
  const compensation::FeatureDefinition features = own.features();
  text += fmt::format("# window: length_s {} end_mean_s {} max_gap_s {}\n", features.length_s, features.end_mean_s,
                      features.max_gap_s);
  if (setup.sensors) text += compensation::sensors_line(*setup.sensors);
  for (const Setup::SensorLine& line : setup.sensor_lines)
    text += fmt::format("# sensor_line: {} {} {}\n", line.name, line.frames->name, line.frames->id);
  if (own.thermometer >= 0) text += fmt::format("# temperature: {}\n", mounted.thermometer);
  if (own.uhfo >= 0) text += fmt::format("# uhfo: {}\n", mounted.uhfo);
  return text;
}

std::string models_text(const Setup& setup) {
  std::string text;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    const compensation::ModelPtr& model = setup.axes[i].model;
    if (i > 0) text += ", ";
    if (setup.axes.size() > 1) text += setup.frames->axes[i].name + " ";
    text += model ? model->info().id.substr(0, 12) + " " + model->info().name : "none";
  }
  return text;
}

std::string unit_name(const Setup& setup) {
  bool network = false;
  for (std::size_t i = 0; i <= setup.sensor_lines.size(); ++i) {
    network = network || transport::needs_network(setup.line_settings(i));
  }
  for (const Setup::Output& output : setup.outputs) network = network || transport::needs_network(output.line);
  return (network ? "prismd-net@" : "prismd@") + std::filesystem::path(setup.config.path).stem().string();
}

std::string log_name(const Setup& setup, std::size_t axis) {
  return setup.config.by_axes ? setup.config.name + "-" + setup.frames->axes[axis].name : setup.config.name;
}

config::LogSegmentSettings log_settings(const Setup& setup) {
  config::LogSegmentSettings settings = *setup.config.log;
  if (settings.keep_bytes < config::kNoByteLimit) settings.keep_bytes /= static_cast<std::int64_t>(setup.axes.size());
  return settings;
}

double log_bytes_per_day(const Setup& setup) {
  const double row = kRowBytes + kSensorBytes * static_cast<double>(sensors_of_list(setup.sensors).size());
  return kDayS * row * static_cast<double>(setup.axes.size());
}

double capture_bytes_per_day(const Setup& setup) {
  const wire::FrameDescription& frames = *setup.frames;
  return kDayS * frames.rate_hz * (kPacketBytes + static_cast<double>(frames.max_frame_bytes));
}

std::string directory_problem(const std::string& directory) {
  namespace fs = std::filesystem;
  const fs::path place = existing_part(directory);
  const bool is_there = place == fs::path(directory);
  const auto problem = [&](const std::string& why) {
    return fmt::format("{}: cannot be {}: {}", directory, is_there ? "written" : "created", why);
  };
  std::error_code error;
  if (!fs::is_directory(place, error)) {
    return error ? "" : problem(is_there ? "it is not a directory" : place.string() + " is not a directory");
  }
  if (const auto space = fs::space(place, error); !error && space.capacity == 0)
    return problem(place.string() + " is a file system without storage");
  if (::access(place.c_str(), W_OK | X_OK) == 0) return {};
  const std::string why = std::error_code(errno, std::generic_category()).message();
  return problem(errno == EACCES ? fmt::format("{} (as the user who ran this check)", why) : why);
}

}  // namespace prism::pipeline
