// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/styled_text.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/escape.hpp"

namespace prism::screen {
namespace {

bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) != 0x80; }

// Offset of the character after `count` characters.
std::size_t offset_of(std::string_view text, int count) {
  std::size_t at = 0;
  for (; at < text.size(); ++at) {
    if (begins_character(text[at]) && count-- == 0) break;
  }
  return at;
}

const char* sequence(Meaning meaning, bool colour) {
  switch (meaning) {
    case Meaning::kStrong:
      return "\033[1m";
    case Meaning::kFaint:
      return colour ? "\033[2m" : "";
    case Meaning::kGood:
      return colour ? "\033[32m" : "";
    case Meaning::kWarning:
      return colour ? "\033[33m" : "\033[1m";
    case Meaning::kBad:
      return colour ? "\033[1;31m" : "\033[1m";
    case Meaning::kCurve:
      return colour ? "\033[36m" : "";
    default:
      return "";
  }
}

std::string ascii(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kReplaced = {
      {{"±", "+"}, {"│", "|"}, {"└", "+"}, {"─", "-"}, {"…", "~"}}};
  std::string plain;
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view character = text.substr(at, offset_of(text.substr(at), 1));
    const auto* found =
        std::find_if(kReplaced.begin(), kReplaced.end(), [&](const auto& pair) { return pair.first == character; });
    plain += found != kReplaced.end() ? found->second : character.size() > 1 ? "?" : character;
    at += character.size();
  }
  return plain;
}

}  // namespace

int columns_of(std::string_view text) {
  return static_cast<int>(std::count_if(text.begin(), text.end(), begins_character));
}

int columns_of(const Line& line) {
  int columns = 0;
  for (const Piece& piece : line) columns += columns_of(piece.text);
  return columns;
}

Line fitted(Line line, int columns) {
  for (Piece& piece : line) piece.text = printable(piece.text);
  const bool cut = columns_of(line) > columns;
  int room = std::max(columns - (cut ? 1 : 0), 0);
  Line result;
  for (const Piece& piece : line) {
    if (room == 0) break;
    Piece part{piece.text.substr(0, offset_of(piece.text, room)), piece.meaning};
    room -= columns_of(part.text);
    result.push_back(std::move(part));
  }
  if (cut && columns > 0) result.push_back({"…", Meaning::kFaint});
  return result;
}

Line with_right(Line left, const Piece& right, int columns) {
  const int gap = columns - columns_of(left) - columns_of(right.text);
  if (gap < 1) return left;
  left.push_back({std::string(static_cast<std::size_t>(gap), ' ')});
  left.push_back(right);
  return left;
}

std::string terminal_text(const Line& line, const Style& style) {
  std::string text;
  for (const Piece& piece : line) {
    const std::string begin = sequence(piece.meaning, style.colour);
    text += begin + (style.utf8 ? piece.text : ascii(piece.text)) + (begin.empty() ? "" : "\033[0m");
  }
  return text;
}

}  // namespace prism::screen
