// SPDX-License-Identifier: MIT
// Draws a plot as an SVG element.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Returns an SVG element, 960 pixels wide in its own units. Escapes all texts of `plot`. Ids begin with
/// "plot<figure_number>-", so that a page can contain several drawings.
std::string draw_svg(const Plot& plot, int figure_number = 1);

}  // namespace prism::report
