// SPDX-License-Identifier: MIT
// The parts of prismd's program: its command line, and what it can request.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/setup.hpp"

namespace prism::daemon {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitClock = 3, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

struct Options {
  std::string config;
  bool check = false;
  bool strict = false;              ///< a model that cannot be used stops the start
  std::vector<std::string> replay;  ///< captures to replay, in order; empty: live
  std::optional<double> speed;      ///< absent: max
  std::string sniff;                ///< device or file to identify
  std::vector<std::string>
      replay_sensors;             ///< LINE=FILE: captures of sensor lines; empty: those next to the first capture
  std::string out_frames;         ///< replay: file for the bytes of the first output
  pipeline::Overrides overrides;  ///< of settings of the configuration
};

/// Parses argv; prints help, version and usage errors. Returns an exit code if prismd must end at once, else nullopt.
std::optional<int> parse_options(int argc, char** argv, Options& options);

/// Connects data, line, socket, disk and systemd on one io_context, and runs on the live gyro until SIGTERM or SIGINT.
/// Returns the exit code.
int run_live(const Options& options, pipeline::Setup setup);

/// Processes the captures of options.replay; prints a summary. Returns the exit code.
int run_replay(const Options& options, pipeline::Setup setup);

/// Tries `description` (a name or a path), or all installed descriptions if it is empty. Sends no bytes. Reads a serial
/// device for one second at each line setting that a description contains, HOST:PORT (TCP) for one second, or a
/// complete file (capture or raw bytes). Prints the descriptions that fit, with counts. Returns 0 if one fits, 1 if
/// none fits or on errors.
int run_sniff(const std::string& path, const std::string& description);

/// `prismd --check` of a frame description or a model: reads it, runs its test vectors and prints one line. Returns 0,
/// 78 after an error line on stderr, or −1 if the file is neither.
int check_document(const std::string& path);

}  // namespace prism::daemon
