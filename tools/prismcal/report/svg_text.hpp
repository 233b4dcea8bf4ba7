// SPDX-License-Identifier: MIT
// Text in a drawing: its width and its element.
#pragma once

#include <string>
#include <string_view>

namespace prism::report {

inline constexpr double kFontPx = 12.5;

/// Pixels of a line of text in a sans-serif font, from classes of characters: a little more than most fonts take.
double text_width(std::string_view text);

/// `text`, or its beginning and "…" if it is wider than `width` pixels.
std::string fitted(std::string_view text, double width);

/// A text element. `anchor`: start, middle or end. `more`: further attributes.
std::string text_svg(double x, double y, std::string_view text, const char* anchor, std::string_view more = {});

}  // namespace prism::report
