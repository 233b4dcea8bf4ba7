// SPDX-License-Identifier: MIT
// Draws one series as SVG elements.
#pragma once

#include <string>

#include "tools/prismcal/report/svg_scale.hpp"

namespace prism::report {

/// Lines and bands have at most two points per pixel column (minimum and maximum); overlapping points are drawn once. A
/// value that is not drawable interrupts a line.
std::string series_svg(const Series& series, const Scale& x, const Scale& y);

/// Sample of a series in the key: `width` pixels wide, centred at `y`.
std::string key_sample_svg(const Series& series, double left, double width, double y);

}  // namespace prism::report
