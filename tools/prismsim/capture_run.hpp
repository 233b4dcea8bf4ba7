// SPDX-License-Identifier: MIT
// Writes the simulated gyro directly to a capture file, as fast as possible.
#pragma once

#include "base/result.hpp"
#include "tools/prismsim/options.hpp"

namespace prism::prismsim {

/// Switch-on time of a capture's simulated gyro: 2026-01-01 00:00:00 UTC, so that the same command gives the same file.
inline constexpr std::int64_t kCaptureStart_ns = 1'767'225'600'000'000'000;

/// Writes the complete run, or the part before a stop signal. Arrival times are as on a real line: latency and wire
/// time after the end of the measured interval. Returns the counts of frames and faults.
Result<simulation::SimulationCounters> run_capture(const SimOptions& options);

}  // namespace prism::prismsim
