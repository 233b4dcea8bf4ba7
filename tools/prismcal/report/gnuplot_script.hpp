// SPDX-License-Identifier: MIT
// A figure as a gnuplot program that writes one SVG.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// The program text. `name` prefixes the ids inside the SVG, so that several can stand in one page; `svg_file` is
/// where gnuplot writes to. Pure.
std::string gnuplot_script(const Plot& plot, const std::string& name, const std::string& svg_file);

}  // namespace prism::report
