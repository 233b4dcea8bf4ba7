// SPDX-License-Identifier: MIT
// One series of a drawing as SVG elements.
#pragma once

#include <string>

#include "tools/prismcal/report/svg_scale.hpp"

namespace prism::report {

/// Lines and bands have at most two points for each column of pixels (the lowest and the highest); points that cover
/// each other are drawn once. A value that is not drawable breaks a line.
std::string series_svg(const Series& series, const Scale& x, const Scale& y);

/// The sample of a key: `width` pixels, its middle `y` pixels from the top.
std::string key_sample_svg(const Series& series, double left, double width, double y);

/// The values of a surface, for the scale of its colours.
Range heat_range(const Series& series);

/// "#rrggbb" of a share from 0 to 1 of a surface's range.
std::string heat_colour(double share);

}  // namespace prism::report
