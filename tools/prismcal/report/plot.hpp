// SPDX-License-Identifier: MIT
// A figure as data: panels of series on labelled axes. draw_svg() makes a picture of it, and chart_json() the data of a
// chart.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace prism::report {

/// What a series means decides its colour, width and dash, the same in every figure; each differs in lightness and
/// form too, so that a grey print can be read.
enum class Ink {
  kRaw,        ///< what the gyro said: light, wide
  kModel,      ///< what a model says: dark, warm
  kCorrected,  ///< what is left: dark, cold
  kAccent1,    ///< further series, told apart by dash
  kAccent2,
  kAccent3,
  kGuide,  ///< limits and reference lines: thin, grey, dashed
};

/// kMark: a large cross for one point that matters.
enum class SeriesStyle { kLine, kPoints, kOpenPoints, kLinePoints, kBand, kBars, kHeat, kMark };

struct Series {
  std::string name;  ///< in the key; empty: not there
  Ink ink = Ink::kRaw;
  SeriesStyle form = SeriesStyle::kLine;
  std::vector<double> x{}, y{};
  std::vector<double> high{};  ///< kBand: upper edge (y is the lower); kHeat: the value at (x, y)
  bool right_axis = false;
};

struct Axis {
  std::string label;  ///< with its unit
  bool logarithmic = false;
  std::optional<double> min{}, max{};
};

struct Panel {
  std::string title;       ///< "(a) …"; empty: none
  Axis x{}, y{}, right{};  ///< right: drawn where a series uses it
  std::vector<Series> series{};
};

/// Panels fill rows of `columns`. A value that is not finite breaks a line.
struct Plot {
  int columns = 1;
  double panel_height = 260;  ///< pixels of a page 960 wide
  std::vector<Panel> panels{};
};

}  // namespace prism::report
