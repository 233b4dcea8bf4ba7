// SPDX-License-Identifier: MIT
// The simulated gyro straight into a capture file, as fast as it can be computed.
#pragma once

#include "base/result.hpp"
#include "tools/prismsim/options.hpp"

namespace prism::prismsim {

/// When a capture's simulated gyro is switched on: 2026-01-01 00:00:00 UTC, so that the same command gives the same
/// file.
inline constexpr std::int64_t kCaptureStart_ns = 1'767'225'600'000'000'000;

/// Writes the whole run, or what was done when a stop signal came. Bytes arrive as on a real line: the frame's latency
/// and wire time after the interval that it measured. What was done to the stream is returned.
Result<simulation::SimulationCounters> run_capture(const SimOptions& options);

}  // namespace prism::prismsim
