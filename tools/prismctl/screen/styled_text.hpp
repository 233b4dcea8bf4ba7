// SPDX-License-Identifier: MIT
// A line of the screen: pieces of text with their meaning, which the terminal maps to colours.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace prism::screen {

enum class Meaning { kPlain, kStrong, kFaint, kGood, kWarning, kBad, kCurve };

struct Piece {
  std::string text;  ///< UTF-8, each character one column
  Meaning meaning = Meaning::kPlain;
};
using Line = std::vector<Piece>;

/// Width of the text in columns: its number of characters.
int columns_of(std::string_view text);
int columns_of(const Line& line);

/// Truncates to `columns`, ending with "…" if truncated. The texts must be printable (escape.hpp).
Line fitted(Line line, int columns);

/// `left`, and `right` at the right edge if it fits.
Line with_right(Line left, const Piece& right, int columns);

struct Style {
  bool colour = true;  ///< false: bold only, for NO_COLOR
  bool utf8 = true;    ///< false: other characters than ASCII are replaced
};

/// The bytes for a terminal.
std::string terminal_text(const Line& line, const Style& style);

}  // namespace prism::screen
