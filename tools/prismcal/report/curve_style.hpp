// SPDX-License-Identifier: MIT
// Colour, width, dash and symbol of an ink, the same in SVG drawings and charts.
#pragma once

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

enum class Symbol { kCircle, kSquare, kTriangle, kTriangleDown, kDiamond, kPlus };

/// `width` in pixels. `dash`: lengths of dashes and gaps in pixels, separated by commas; "": solid line.
struct CurveStyle {
  const char* colour;
  double width;
  const char* dash;
  Symbol symbol;
};

inline CurveStyle curve_style(Ink ink) {
  switch (ink) {
    case Ink::kRaw:
      return {"#9db2c7", 1.3, "", Symbol::kCircle};
    case Ink::kModel:
      return {"#c2410c", 1.8, "", Symbol::kSquare};
    case Ink::kCorrected:
      return {"#12385f", 1.4, "", Symbol::kCircle};
    case Ink::kAccent1:
      return {"#1f7a5c", 1.5, "9,4", Symbol::kTriangle};
    case Ink::kAccent2:
      return {"#7a4fa3", 1.5, "3,3", Symbol::kTriangleDown};
    case Ink::kAccent3:
      return {"#b8860b", 1.5, "12,3,2,3", Symbol::kDiamond};
    case Ink::kGuide:
      return {"#6b7280", 1.0, "5,4", Symbol::kPlus};
  }
  return {"#000000", 1, "", Symbol::kCircle};
}

}  // namespace prism::report
