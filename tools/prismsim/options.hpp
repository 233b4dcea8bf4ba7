// SPDX-License-Identifier: MIT
// Command line of prismsim.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/transport/transport.hpp"
#include "tools/prismsim/simulation/simulated_line.hpp"

namespace prism::prismsim {

struct SimOptions {
  simulation::SimulationSettings simulation;
  wire::FrameDescriptionPtr frames;
  double duration_s = 0;          ///< > 0
  std::string out;                ///< capture file; empty: none
  std::string truth;              ///< truth file; empty: none
  bool terminal = false;          ///< send on a pseudo-terminal
  std::string link;               ///< symbolic link to it; empty: none
  bool wait = false;              ///< the simulation starts when a program opens the terminal
  transport::Network network;     ///< send on a network line; empty type: no
  bool obey = false;              ///< sends only after the description's start commands, or when asked
  bool overrun = false;           ///< drops bytes if the pseudo-terminal is full
  std::optional<double> speed;    ///< of the pseudo-terminal's time; nullopt: as fast as the reader
  std::uint64_t chunk_bytes = 0;  ///< bytes per capture packet; 0: one frame

  std::uint64_t total_frames() const;
};

/// Reads the command line and its frame description. Returns the exit code if the program must end now: after --help
/// (0), on an invalid command line (64) or frame description (78), with one line on stderr.
std::optional<int> parse_sim_options(int argc, char** argv, SimOptions& options);

}  // namespace prism::prismsim
