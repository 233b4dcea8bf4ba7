// SPDX-License-Identifier: MIT
// Runs gnuplot: a figure in, the text of an SVG element out.
#pragma once

#include <string>

#include "compensation/result.hpp"
#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Draws in a folder of its own under TMPDIR, which is removed again. `name` as in gnuplot_script(). The SVG begins
/// with "<svg": the XML head that a page cannot hold is cut off. Refused: gnuplot not installed, or its own words.
Result<std::string> draw_svg(const Plot& plot, const std::string& name);

}  // namespace prism::report
