// SPDX-License-Identifier: MIT
#include "daemon/pipeline/setup.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "compensation/model_text.hpp"
#include "config/search_path.hpp"
#include "config/version.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::pipeline {
namespace {

wire::WireFormat wire_format(const config::LineConfig& line, wire::WireFormat wire) {
  wire.baud = line.baud.value_or(wire.baud);
  wire.data_bits = line.data_bits.value_or(wire.data_bits);
  wire.stop_bits = line.stop_bits.value_or(wire.stop_bits);
  if (line.parity)
    wire.parity = *line.parity == "even"  ? wire::Parity::kEven
                  : *line.parity == "odd" ? wire::Parity::kOdd
                                          : wire::Parity::kNone;
  return wire;
}

Result<wire::FrameDescriptionPtr> load_frames(const config::Config& config) {
  const Result<std::string> text = config::read_data_file(config.frames, "frames");
  if (!text) return tl::unexpected<Error>(text.error());
  wire::GyroChoice choice;
  choice.axis = config.gyro.axis;
  choice.sign = config.gyro.sign;
  choice.scale_factor_arcsec_per_pulse = config.gyro.scale_factor_arcsec_per_pulse;
  Result<wire::FrameDescriptionPtr> frames = wire::parse_frame_description(*text, config.frames, choice);
  if (!frames) return frames;
  if (auto proved = wire::run_test_vectors(**frames); !proved) return tl::unexpected<Error>(proved.error());
  // The line as it is set, not as the description suggests: the time stamps subtract the time that a byte takes on it.
  auto effective = std::make_shared<wire::FrameDescription>(**frames);
  effective->wire = wire_format(config.line, effective->wire);
  return wire::FrameDescriptionPtr(std::move(effective));
}

// A model takes what the stream carries, of the gyro it was trained on, or is refused.
Result<compensation::ModelPtr> load_model(const config::Config& config, const std::string& path,
                                          const wire::FrameDescription& frames) {
  if (path.empty()) return compensation::ModelPtr();
  const Result<std::string> text = config::read_data_file(path, "models");
  if (!text) return tl::unexpected<Error>(text.error());
  Result<compensation::ModelPtr> model = compensation::parse_model(*text, path);
  if (!model) return model;
  const compensation::ModelInfo& info = (*model)->info();
  if (!info.gyro_serial.empty() && !config.gyro.serial.empty() && info.gyro_serial != config.gyro.serial) {
    return refuse(path + ":/gyro/serial",
                  fmt::format("found \"{}\", expected \"{}\" as {} says: a model of another gyro", info.gyro_serial,
                              config.gyro.serial, config.path));
  }
  for (const std::string& input : info.inputs) {
    const bool carried = (input == compensation::kInputUhfo ? frames.uhfo : frames.temperature).present;
    if (carried) continue;
    return refuse(path + ":/inputs", fmt::format("found {}, which frames of \"{}\" do not carry", input, frames.name));
  }
  return model;
}

drivers::LineSettings line_settings(const config::Config& config, const wire::WireFormat& wire) {
  drivers::LineSettings line;
  line.device = config.line.device;
  line.baud = wire.baud;
  line.data_bits = wire.data_bits;
  line.stop_bits = wire.stop_bits;
  line.parity = wire.parity;
  return line;
}

void replace(config::Config& config, const Overrides& overrides) {
  namespace fs = std::filesystem;
  const auto absolute = [](const std::string& path) {
    std::error_code error;
    const fs::path found = fs::absolute(path, error);
    return error ? path : found.string();
  };
  if (!overrides.model.empty()) config.model = config::find_data_file(overrides.model, "models", absolute("."));
  if (overrides.without_models) config.model.clear(), config.fallback_model.clear();
  if (!overrides.device.empty()) config.line.device = absolute(overrides.device);
  if (!overrides.socket.empty()) config.socket.path = absolute(overrides.socket);
  if (overrides.replay_log.empty()) return;
  config.capture.reset();
  config.log = config.log.value_or(config::SegmentSettings{});
  config.log->directory = absolute(overrides.replay_log);
}

}  // namespace

Result<Setup> load_setup(const std::string& config_path, const Overrides& overrides) {
  Result<config::Config> config = config::load_config(config_path);
  if (!config) return tl::unexpected<Error>(config.error());
  Setup setup;
  setup.config = std::move(*config);
  replace(setup.config, overrides);
  const Result<wire::FrameDescriptionPtr> frames = load_frames(setup.config);
  if (!frames) return tl::unexpected<Error>(frames.error());
  setup.frames = *frames;
  compensation::PlausibilityLimits& plausible = setup.config.engine.plausibility;
  plausible.take(setup.frames->plausible);
  plausible.take(setup.config.plausibility);
  for (auto [path, model] :
       {std::pair(&setup.config.model, &setup.model), {&setup.config.fallback_model, &setup.fallback}}) {
    Result<compensation::ModelPtr> loaded = load_model(setup.config, *path, *setup.frames);
    if (!loaded) return tl::unexpected<Error>(loaded.error());
    *model = std::move(*loaded);
  }
  compensation::Engine trial(setup.config.engine);
  if (auto taken = trial.use(setup.model, setup.fallback); !taken) {
    return refuse(setup.config.fallback_model, taken.error().what);
  }
  setup.line = line_settings(setup.config, setup.frames->wire);
  setup.clock.source = setup.config.device_clock ? drivers::ClockSource::kDevice : drivers::ClockSource::kHost;
  setup.notes = setup.frames->warnings;
  setup.notes.insert(setup.notes.end(), setup.config.warnings.begin(), setup.config.warnings.end());
  if (setup.model && !setup.model->info().gyro_serial.empty() && setup.config.gyro.serial.empty()) {
    setup.notes.push_back(fmt::format("{}: bound to gyro \"{}\", but {} names no gyro/serial to compare it with",
                                      setup.config.model, setup.model->info().gyro_serial, config_path));
  }
  return setup;
}

std::string log_metadata(const Setup& setup) {
  const config::Config& config = setup.config;
  const auto model_line = [](const compensation::ModelPtr& model) {
    return model ? fmt::format("{} {}", model->info().id, model->info().name) : std::string("none");
  };
  std::string text = fmt::format("# prism {} data log, format 2\n# instance: {}\n# gyro_serial: {}\n", kVersion,
                                 config.name, config.gyro.serial.empty() ? "unknown" : config.gyro.serial);
  text += fmt::format("# frames: {} {}\n# axis: {}\n# clock: {}\n", setup.frames->name, setup.frames->id,
                      setup.frames->gyro.axis.empty() ? "-" : setup.frames->gyro.axis,
                      config.device_clock ? "device" : "host");
  text += fmt::format("# gyro_unit: {}\n# model: {}\n# fallback_model: {}\n", setup.frames->gyro.scale,
                      model_line(setup.model), model_line(setup.fallback));
  if (config.site.elevation_deg) {
    text += fmt::format("# site: latitude_deg {} elevation_deg {} azimuth_deg {}\n", config.site.latitude_deg,
                        *config.site.elevation_deg, config.site.azimuth_deg);
  }
  const compensation::FeatureDefinition features =
      setup.model ? setup.model->info().features : compensation::FeatureDefinition{};
  text += fmt::format("# window: length_s {} end_mean_s {} max_gap_s {}\n", features.length_s, features.end_mean_s,
                      features.max_gap_s);
  return text;
}

}  // namespace prism::pipeline
