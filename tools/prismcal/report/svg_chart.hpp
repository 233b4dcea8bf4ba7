// SPDX-License-Identifier: MIT
// Draws a figure: a plot as the text of an SVG element.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// An SVG element, 960 pixels wide in its own units. Every text of `plot` is plain text in it. Ids begin with
/// "plot<figure_number>-", so that several drawings can be in one page. Pure.
std::string draw_svg(const Plot& plot, int figure_number = 1);

}  // namespace prism::report
