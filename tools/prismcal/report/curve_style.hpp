// SPDX-License-Identifier: MIT
// How an ink looks, wherever it is drawn.
#pragma once

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Width in pixels; `dash` as gnuplot takes it, "solid" or "(ON,OFF,…)"; gnuplot's numbers of the point, filled and
/// open.
struct CurveStyle {
  const char* colour;
  double width;
  const char* dash;
  int point, open_point;
};

inline CurveStyle curve_style(Ink ink) {
  switch (ink) {
    case Ink::kRaw:
      return {"#9db2c7", 1.3, "solid", 7, 6};
    case Ink::kModel:
      return {"#c2410c", 1.8, "solid", 5, 4};
    case Ink::kCorrected:
      return {"#12385f", 1.4, "solid", 7, 6};
    case Ink::kAccent1:
      return {"#1f7a5c", 1.5, "(9,4)", 9, 8};
    case Ink::kAccent2:
      return {"#7a4fa3", 1.5, "(3,3)", 11, 10};
    case Ink::kAccent3:
      return {"#b8860b", 1.5, "(12,3,2,3)", 13, 12};
    case Ink::kGuide:
      return {"#6b7280", 1.0, "(5,4)", 1, 1};
  }
  return {"#000000", 1, "solid", 7, 6};
}

}  // namespace prism::report
