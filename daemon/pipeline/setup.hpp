// SPDX-License-Identifier: MIT
// Loads and checks a configuration and all files it refers to. Any error rejects the set.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/model.hpp"
#include "config/config.hpp"
#include "drivers/clock.hpp"
#include "drivers/transport/transport.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

struct Setup {
  /// One input axis: models and settings of its engine.
  struct Axis {
    compensation::ModelPtr model, fallback;  ///< null: none
    std::string model_problem;               ///< why the configured models are not used; empty: they are
    int thermometer = -1;                    ///< configured thermometer, index into Setup::sensors; -1: not configured
    int uhfo = -1;                           ///< the same of the UHFO voltage
    compensation::CompensationSettings
        engine;  ///< plausibility limits combine defaults, frame description and configuration

    compensation::FeatureDefinition features() const {
      return model ? model->info().features : compensation::FeatureDefinition{};
    }
    /// Compares models by pointer: a model that was loaded again is another one.
    bool operator==(const Axis&) const = default;
  };

  /// An instrument on a line of its own.
  struct SensorLine {
    std::string name;
    wire::FrameDescriptionPtr frames;
    transport::Settings line;
    double stale_after_s;
  };

  /// A line on which corrected frames leave.
  struct Output {
    config::OutputConfig config;
    wire::FrameDescriptionPtr frames;  ///< that are encoded; null: "same" or "prism"
    transport::Settings line;

    /// Compares the settings of the line; the device's own format is the output's, too, if its frames are the same.
    bool operator==(const Output& other) const { return config == other.config && line == other.line; }
  };

  config::Config config;
  std::int64_t loaded_ns = 0;  ///< host time of the start or last reload; 0: a replay
  wire::FrameDescriptionPtr frames;
  std::vector<SensorLine> sensor_lines;  ///< as config.sensor_lines
  std::vector<Axis> axes;                ///< as frames->axes and config.axes
  SensorList sensors;                    ///< frames->sensors(), then those of each line, named LINE.SENSOR; null: none
  std::vector<Output> outputs;
  transport::Settings line;
  drivers::ClockSettings clock;
  std::vector<std::string> notes;  ///< warnings, one line each

  /// Settings of a line: 0 is the gyro's line, the sensor lines follow.
  const config::LineConfig& line_config(std::size_t number) const {
    return number == 0 ? config.line : config.sensor_lines[number - 1].line;
  }
  const wire::Commands& line_commands(std::size_t number) const {
    return (number == 0 ? frames : sensor_lines[number - 1].frames)->commands;
  }
  const transport::Settings& line_settings(std::size_t number) const {
    return number == 0 ? line : sensor_lines[number - 1].line;
  }
};

/// Command-line settings that replace those of the configuration. Empty: as configured.
struct Overrides {
  std::string model;   ///< path, or bare name, searched in ./models first; an error with several axes
  std::string device;  ///< path of a tty
  std::string socket;  ///< path
  std::string
      replay_log;  ///< directory of a replay's log, so that a replay does not change live files; it writes no capture
  bool accept_clock = false;  ///< as accept_clock of the configuration
  /// Models that cannot be used are left out, with Axis::model_problem, so that the raw rates are recorded.
  bool tolerate_models = false;
  bool without_models = false;  ///< loads no models: for training, which needs the one-second means only
};

/// Reads the configuration, its frame descriptions (and runs their test vectors) and its models. Overrides are applied
/// after the configuration was checked, before its files are read. Errors: among others, a model of another gyro, or
/// one with inputs that the frames do not have.
Result<Setup> load_setup(const std::string& config_path, const Overrides& overrides = {});

/// Metadata at the top of each log segment of an axis: instance, gyro, frames, clock, models, site, window and sensors.
/// They identify the decoding and the models, but no other setting of the correction (plausibility, max_bias, slew,
/// extrapolation), and no time of writing.
std::string log_metadata(const Setup& setup, std::size_t axis);

/// Short text of the models in use, without the fallback models: start of the id and name; with axis names if there are
/// several.
std::string models_text(const Setup& setup);

/// The systemd unit that the set-up needs: `prismd@NAME`, or `prismd-net@NAME` if a line goes through a network.
std::string unit_name(const Setup& setup);

/// Base name of an axis's log segments: the instance, and the axis if the configuration has "axes".
std::string log_name(const Setup& setup, std::size_t axis);

/// Settings of the log of each axis: they share the configured size limit. A log must be configured.
config::LogSegmentSettings log_settings(const Setup& setup);

// How fast the log and the capture grow, and whether their directories can be written, before there are data.

/// From the described frame rate and lengths, as measured.
double log_bytes_per_day(const Setup& setup);
double capture_bytes_per_day(const Setup& setup);

/// Why the service would not be able to write to `directory`, as far as this user can tell without writing; "" if
/// nothing speaks against it. Asks the file system; may wait for it.
std::string directory_problem(const std::string& directory);

}  // namespace prism::pipeline
