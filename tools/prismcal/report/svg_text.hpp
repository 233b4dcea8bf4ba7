// SPDX-License-Identifier: MIT
// Text in a drawing: width and SVG element.
#pragma once

#include <string>
#include <string_view>

namespace prism::report {

inline constexpr double kFontPx = 12.5;

/// Estimated pixels of a line of text in a sans-serif font; slightly more than most fonts need.
double text_width(std::string_view text);

/// Returns `text`, truncated with "…" if it is wider than `width` pixels.
std::string fitted(std::string_view text, double width);

/// Returns a text element. `anchor`: start, middle or end. `more`: additional attributes.
std::string text_svg(double x, double y, std::string_view text, const char* anchor, std::string_view more = {});

}  // namespace prism::report
