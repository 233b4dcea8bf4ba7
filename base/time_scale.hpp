// SPDX-License-Identifier: MIT
// A scale of waits, for tests: with PRISM_TIME_SCALE=10 in the environment, programs wait a tenth of the usual time.
#pragma once

#include <chrono>
#include <cstdint>

#include "base/result.hpp"

namespace prism {

/// Errors: PRISM_TIME_SCALE is set, but is not a number within 1 to 100. Programs check it at their start.
Result<void> check_time_scale();

/// Returns `wait` divided by PRISM_TIME_SCALE, or `wait` if the variable is unset or invalid. Only for real waits:
/// polls, retries, quiet periods, limits. The time of data is never scaled.
std::chrono::steady_clock::duration scaled(std::chrono::steady_clock::duration wait);
/// The same, rounded to seconds, at least 1.
std::int64_t scaled_s(std::int64_t wait_s);

}  // namespace prism
