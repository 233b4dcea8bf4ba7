// SPDX-License-Identifier: MIT
// Draws a plot as an SVG element.
#pragma once

#include <string>

#include "tools/prismcal/document.hpp"

namespace prism::report {

/// Returns an SVG element without ids, 960 pixels wide in its own units. Escapes all texts of `plot`. Lines and bands
/// have at most two points per pixel column (minimum and maximum); overlapping points are drawn once. A value that
/// cannot be drawn interrupts a line.
std::string draw_svg(const Plot& plot);

}  // namespace prism::report
