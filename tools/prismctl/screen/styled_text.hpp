// SPDX-License-Identifier: MIT
// A line of the screen: pieces of text, each with what it means; the terminal alone knows colours.
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

/// Columns that the text takes: its characters.
int columns_of(std::string_view text);
int columns_of(const Line& line);

/// Cut to `columns`, with "…" where something was cut; the texts are printable (escape.hpp).
Line fitted(Line line, int columns);

/// `left`, and `right` at the right edge where there is room for it.
Line with_right(Line left, const Piece& right, int columns);

struct Style {
  bool colour = true;  ///< false: weights only, as NO_COLOR asks
  bool utf8 = true;    ///< false: what stands beyond ASCII is replaced
};

/// The bytes for a terminal.
std::string terminal_text(const Line& line, const Style& style);

}  // namespace prism::screen
