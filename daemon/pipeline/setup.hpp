// SPDX-License-Identifier: MIT
// Everything that a configuration names, loaded and checked together: all of it holds, or none is taken.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/engine.hpp"
#include "compensation/model.hpp"
#include "config/config.hpp"
#include "drivers/clock.hpp"
#include "drivers/transport/transport.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

struct Setup {
  /// One input axis: what its engine is made of.
  struct Axis {
    compensation::ModelPtr model, fallback;
    int thermometer = -1;                 ///< what the configuration says: index into Setup::sensors; -1: nothing
    compensation::EngineSettings engine;  ///< its plausibility joins presets, frame description and configuration

    compensation::FeatureDefinition features() const {
      return model ? model->info().features : compensation::FeatureDefinition{};
    }
    bool operator==(const Axis&) const = default;
  };

  /// An instrument beside the gyro.
  struct SensorLine {
    std::string name;
    wire::FrameDescriptionPtr frames;
    transport::Settings line;
    double stale_after_s;
  };

  config::Config config;
  wire::FrameDescriptionPtr frames;
  std::vector<SensorLine> sensor_lines;  ///< as config.sensor_lines
  std::vector<Axis> axes;                ///< as frames->axes and config.axes
  SensorList sensors;                    ///< frames->sensors, then those of each line; null: none
  transport::Settings line;
  drivers::ClockSettings clock;
  std::vector<std::string> notes;  ///< legal, but worth knowing: one line each

  /// Of each line; 0 is the gyro's, those behind it are the sensor lines.
  const config::LineConfig& line_config(std::size_t number) const {
    return number == 0 ? config.line : config.sensor_lines[number - 1].line;
  }
  const transport::Settings& line_settings(std::size_t number) const {
    return number == 0 ? line : sensor_lines[number - 1].line;
  }
};

/// What a command line puts in the place of a configuration's settings. Empty: the configuration's.
struct Overrides {
  std::string model;   ///< path, or bare name as in the configuration
  std::string device;  ///< path of a tty
  std::string socket;  ///< path
  std::string
      replay_log;  ///< a replay never touches what a live run writes: its log goes here, and it captures nothing
  bool without_models = false;  ///< the path up to the seconds: the models are still to be made from them
};

/// Reads the configuration, its frame description (and runs its test vectors) and its models, and checks that they go
/// together: a model of another gyro, or one whose inputs the frames do not carry, is refused.
/// What is overridden is replaced before anything is checked.
Result<Setup> load_setup(const std::string& config_path, const Overrides& overrides = {});

/// The metadata on top of every log segment of an axis: what the rows depend on, and nothing of the moment they were
/// written in.
std::string log_metadata(const Setup& setup, std::size_t axis);

/// Which models serve, in a few words: the first characters of the id and the name; by axis where there are several.
std::string models_text(const Setup& setup);

/// What an axis's log segments are named after: the instance, and the axis where the configuration names several.
std::string log_name(const Setup& setup, std::size_t axis);

}  // namespace prism::pipeline
