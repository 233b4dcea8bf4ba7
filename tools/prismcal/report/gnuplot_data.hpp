// SPDX-License-Identifier: MIT
// The numbers of a figure as gnuplot's data blocks.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Series s of panel p becomes the block $dp_s: lines "x y high", or for a surface the rectangle of each point,
/// "x y xlow xhigh ylow yhigh value". A value that is not finite becomes an empty line: the curve breaks there.
void write_gnuplot_data(std::string& script, const Plot& plot);

}  // namespace prism::report
