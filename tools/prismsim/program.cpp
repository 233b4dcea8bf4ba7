// SPDX-License-Identifier: MIT
#include "tools/prismsim/program.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "tools/prismsim/capture_run.hpp"
#include "tools/prismsim/network_outlet.hpp"
#include "tools/prismsim/options.hpp"
#include "tools/prismsim/pseudo_terminal.hpp"
#include "tools/prismsim/stop.hpp"
#include "tools/prismsim/terminal_run.hpp"

namespace prism::prismsim {
namespace {

constexpr int kDone = 0, kFailed = 1;

int fail(const Error& error) {
  fmt::print(stderr, "prismsim: {}\n", error.text());
  return kFailed;
}

void announce(const SimOptions& options) {
  const simulation::SimulationSettings& simulation = options.simulation;
  const wire::FrameDescription& frames = *options.frames;
  fmt::print(stderr, "prismsim: simulated gyro, profile {}, seed {}, {} frames/s of \"{}\", {:.2f} h\n",
             simulation.profile.name, simulation.seed, simulation.rate_hz, frames.name, options.duration_s / 3600);
  if (std::abs(simulation.rate_hz - frames.rate_hz) > std::max(frames.rate_tolerance, 1e-6) * frames.rate_hz) {
    fmt::print(stderr, "prismsim: note: \"{}\" is described at {} frames/s; its reader needs \"rate_hz\": {}\n",
               frames.name, frames.rate_hz, simulation.rate_hz);
  }
  const double load = simulation.rate_hz * frames.max_frame_bytes * frames.wire.byte_time_ns() * 1e-9;
  if (load > 1) {
    fmt::print(stderr, "prismsim: note: the line of \"{}\" ({} baud) would need {:.1f} s for a second of frames\n",
               frames.name, frames.wire.baud, load);
  }
}

int conclude(const Result<simulation::SimulationCounters>& done, const std::string& where,
             const wire::FrameDescription& frames) {
  if (!done) return fail(done.error());
  const simulation::SimulationCounters& counters = *done;
  fmt::print(stderr, "prismsim: {}: {} simulated frames", where, counters.frames);
  const std::pair<std::uint64_t, const char*> faults[]{{counters.lost_frames, "frames lost"},
                                                       {counters.dropped_bytes, "bytes dropped"},
                                                       {counters.damaged_bytes, "bytes damaged"},
                                                       {counters.overrun_bytes, "bytes lost to a slow reader"},
                                                       {counters.outliers, "outliers"}};
  for (const auto& [count, name] : faults) {
    if (count > 0) fmt::print(stderr, ", {} {}", count, name);
  }
  fmt::print(stderr, "\n");
  if (counters.parts.size() < 2) return kDone;
  for (std::size_t i = 0; i < counters.parts.size(); ++i) {
    const simulation::BiasParts& parts = counters.parts[i];
    fmt::print(
        stderr,
        "prismsim: axis {}: bias, 1 sigma: {:.4f} deg/h from its own temperature, slope and voltage; {:.4f} from the "
        "gradient to the case; {:.4f} that no thermometer detects\n",
        frames.axes[i].name, parts.own, parts.gradient, parts.hidden);
  }
  return kDone;
}

}  // namespace

int run(int argc, char** argv) {
  SimOptions options;
  if (auto code = parse_sim_options(argc, argv, options)) return *code;
  catch_stop_signals();
  announce(options);
  if (!options.network.type.empty()) {
    NetworkOutlet outlet(options.network);
    const auto done = run_terminal(options, outlet);
    return conclude(done, outlet.path(), *options.frames);
  }
  if (!options.terminal) return conclude(run_capture(options), options.out, *options.frames);
  auto terminal = PseudoTerminal::open(options.link);
  if (!terminal) return fail(terminal.error());
  fmt::print("{}\n", terminal->path());
  std::fflush(stdout);
  const auto done = run_terminal(options, *terminal);
  return conclude(done, terminal->path(), *options.frames);
}

}  // namespace prism::prismsim
