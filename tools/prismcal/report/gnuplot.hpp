// SPDX-License-Identifier: MIT
// Gnuplot draws: a figure in, the text of an SVG element out.
#pragma once

#include <string>

#include "base/result.hpp"
#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Series s of panel p becomes the block $dp_s: lines "x y high", or for a surface the rectangle of each point,
/// "x y xlow xhigh ylow yhigh value". A value that is not finite becomes an empty line: the curve breaks there.
void write_gnuplot_data(std::string& script, const Plot& plot);

/// The program text. `name` prefixes the ids inside the SVG, so that several can stand in one page; `svg_file` is
/// where gnuplot writes to. Pure.
std::string gnuplot_script(const Plot& plot, const std::string& name, const std::string& svg_file);

/// Draws in a folder of its own under TMPDIR, which is removed again. `name` as in gnuplot_script(). The SVG begins
/// with "<svg": the XML head that a page cannot hold is cut off. Refused: gnuplot not installed, or its own words.
Result<std::string> draw_svg(const Plot& plot, const std::string& name);

}  // namespace prism::report
