// SPDX-License-Identifier: MIT
// Rounding on the path of every frame.
#pragma once

#include <cstdint>

namespace prism::drivers {

/// The nearest whole number, halves away from zero, of a finite x below 2^52 in magnitude: std::llround without the
/// call. The page of the mathematical library is cold when a frame comes after milliseconds of nothing.
inline std::int64_t nearest(double x) { return static_cast<std::int64_t>(x < 0 ? x - 0.5 : x + 0.5); }

}  // namespace prism::drivers
