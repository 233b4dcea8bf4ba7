// SPDX-License-Identifier: MIT
// A figure as data: panels of series on labelled axes. Input of draw_svg().
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace prism::report {

/// The meaning of a series determines its colour, width and dash in all figures. Inks also differ in lightness and
/// symbol, so that a grey print is readable.
enum class Ink {
  kRaw,        ///< measured values: light, wide
  kModel,      ///< predictions of a model: dark, warm
  kCorrected,  ///< corrected values, residuals: dark, cold
  kAccent1,    ///< further series, with different dashes
  kAccent2,
  kAccent3,
  kGuide,  ///< limits and reference lines: thin, grey, dashed
};

enum class SeriesStyle { kLine, kPoints, kOpenPoints, kLinePoints, kBand, kBars };

struct Series {
  std::string name;  ///< in the key; empty: not in the key
  Ink ink = Ink::kRaw;
  SeriesStyle form = SeriesStyle::kLine;
  std::vector<double> x{}, y{};
  std::vector<double> high{};  ///< kBand: upper edge (y is the lower)
  bool right_axis = false;
};

/// True if a point can be drawn.
inline bool is_known(const Series& series, std::size_t i) {
  return std::isfinite(series.x[i]) && std::isfinite(series.y[i]);
}

struct Axis {
  std::string label;  ///< with its unit
  bool logarithmic = false;
  std::optional<double> min{}, max{};
};

struct Panel {
  std::string title;       ///< "(a) …"; empty: none
  Axis x{}, y{}, right{};  ///< right: drawn if a series uses it
  std::vector<Series> series{};
};

/// Panels are arranged in rows of `columns`. A value that is not finite interrupts a line.
struct Plot {
  int columns = 1;
  double panel_height = 260;  ///< pixels, for a width of 960
  std::vector<Panel> panels{};
};

}  // namespace prism::report
