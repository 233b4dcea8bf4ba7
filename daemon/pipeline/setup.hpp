// SPDX-License-Identifier: MIT
// Everything that a configuration names, loaded and checked together: all of it holds, or none is taken.
#pragma once

#include <string>
#include <vector>

#include "compensation/model.hpp"
#include "compensation/result.hpp"
#include "config/config.hpp"
#include "drivers/clock.hpp"
#include "drivers/serial_line.hpp"
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

struct Setup {
  config::Config config;
  wire::FrameDescriptionPtr frames;
  compensation::ModelPtr model, fallback;
  drivers::LineSettings line;
  drivers::ClockSettings clock;
  std::vector<std::string> notes;  ///< legal, but worth knowing: one line each
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

/// The metadata on top of every log segment: what the rows depend on, and nothing of the moment they were written in.
std::string log_metadata(const Setup& setup);

}  // namespace prism::pipeline
