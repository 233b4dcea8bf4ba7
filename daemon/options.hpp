// SPDX-License-Identifier: MIT
// prismd's command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/setup.hpp"

namespace prism::daemon {

struct Options {
  std::string config;
  bool check = false;
  bool strict = false;              ///< a model that cannot be used stops the start
  bool accept_clock = false;        ///< frames may arrive at another rate than described
  std::vector<std::string> replay;  ///< captures to replay, in order; empty: live
  std::optional<double> speed;      ///< absent: max
  std::string sniff;                ///< device or file to identify
  std::vector<std::string>
      replay_sensors;      ///< LINE=FILE: captures of sensor lines; empty: those next to the first capture
  std::string out;         ///< replay: directory of the log
  std::string out_frames;  ///< replay: file for the bytes of the first output
  std::string socket;      ///< replaces socket/path
  std::string model;       ///< replaces the configuration's model
  std::string device;      ///< replaces line/device
};

/// Returns the command-line options that replace settings of the configuration.
pipeline::Overrides overrides_of(const Options& options);

/// Parses argv; prints help, version and usage errors. Returns an exit code if prismd must end at once, else nullopt.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::daemon
