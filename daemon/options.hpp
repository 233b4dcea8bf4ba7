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
  std::vector<std::string> replay;          ///< captures to replay, in order; empty: live
  std::optional<double> speed;              ///< absent: max
  std::string sniff;                        ///< device or file to recognise
  std::vector<std::string> replay_sensors;  ///< LINE=FILE: captures of sensor lines; empty: those beside the first
  std::string out;                          ///< replay: folder of the log
  std::string socket;                       ///< replaces socket/path
  std::string model;                        ///< replaces the configuration's model
  std::string device;                       ///< replaces line/device
};

/// What of the command line stands in the place of the configuration's settings.
pipeline::Overrides overrides_of(const Options& options);

/// Parses argv; prints help, version and usage errors itself. A value: the exit code to end with at once.
std::optional<int> parse_options(int argc, char** argv, Options& options);

}  // namespace prism::daemon
