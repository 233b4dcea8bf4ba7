// SPDX-License-Identifier: MIT
// What prismsim was asked for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

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
  bool wait = false;              ///< time begins when somebody reads
  bool overrun = false;           ///< bytes that find the pseudo-terminal full are lost
  std::optional<double> speed;    ///< of the pseudo-terminal's time; nothing: as fast as it is read
  std::uint64_t chunk_bytes = 0;  ///< bytes of a capture packet; 0: what arrives of one frame

  std::uint64_t total_frames() const;
};

/// Reads the command line, and the frame description it names. Returns the exit code instead where the program is to
/// end at once: after --help (0), on a wrong command line (64) or frame description (78), with one line on stderr.
std::optional<int> parse_sim_options(int argc, char** argv, SimOptions& options);

}  // namespace prism::prismsim
