// SPDX-License-Identifier: MIT
// A small line plot in text: braille dots (2 × 4 a character), or stars where the terminal has no UTF-8.
#pragma once

#include <string>
#include <vector>

namespace prism::prismctl {

struct PlotSize {
  int columns = 60, rows = 8;  ///< characters of the plotting area, >= 2
  bool utf8 = true;
};

/// Lines of the plot, each `rows` high, with the scale at the left: values' minimum and maximum, `unit` named on top.
/// Values that are not finite leave a hole. The newest value is at the right edge.
std::vector<std::string> plot(const std::vector<double>& values, const PlotSize& size);

}  // namespace prism::prismctl
