// SPDX-License-Identifier: MIT
#include "drivers/hex_dump.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

namespace prism::drivers {
namespace {

using Bytes = std::vector<std::uint8_t>;

int digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = static_cast<char>(c | 32);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

bool all_hex(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return digit(c) >= 0; });
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(" \t,;");
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t,;"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

/// The digits of a word of bytes; empty for another word. "0xA5" and "A5h" are bytes, too.
std::string_view byte_digits(std::string_view word) {
  if (word.starts_with("0x") || word.starts_with("0X")) word.remove_prefix(2);
  if (word.size() == 3 && (word.back() == 'h' || word.back() == 'H')) word.remove_suffix(1);
  return word.size() % 2 == 0 && all_hex(word) ? word : std::string_view();
}

/// "9.2927"; a stamp of a dump is one at most.
bool is_decimal(std::string_view word) {
  const std::size_t point = word.find('.');
  return point != std::string_view::npos && point + 1 < word.size() &&
         std::all_of(word.begin() + (word.starts_with('-') ? 1 : 0), word.end(),
                     [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
}

void append(std::string_view digits, Bytes& bytes) {
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(digit(digits[i]) * 16 + digit(digits[i + 1])));
}

enum class LineKind { kData, kMark, kRepeat, kOther };

struct Line {
  LineKind kind = LineKind::kOther;
  bool dumped = false;  ///< has an offset, a direction or a stamp: certainly a dump
  std::optional<std::size_t> offset;
  int direction = 0;  ///< 0: not stated, 1: <, RX; 2: >, TX
  Bytes bytes;
};

/// Removes "00000010: " or "00000010  " and the column of characters after the bytes.
void strip_offset(std::string_view& text, Line& line) {
  const std::size_t end = std::min(text.find_first_of(" :"), text.size());
  const bool colon = end < text.size() && text[end] == ':';
  if (end < 6 || end > 16 || !all_hex(text.substr(0, end))) return;
  if (!colon && end < text.size() && !text.substr(end).starts_with("  ")) return;
  std::size_t offset = 0;
  for (const char c : text.substr(0, end)) offset = offset * 16 + static_cast<std::size_t>(digit(c));
  text.remove_prefix(std::min(text.size(), end + 1));
  line.offset = offset;
  line.dumped = true;
  std::size_t stop = text.find('|');  // hexdump -C; among the characters of xxd, a bar is one of them
  if (colon) stop = std::min(stop, text.find("  ", std::min(text.find_first_not_of(' '), text.size())));
  text = text.substr(0, stop);
}

int direction_of(std::string_view word) {
  constexpr std::array<std::string_view, 6> kIn = {"<", "[RX]", "RX", "RX:", "<--", "[RX]:"};
  constexpr std::array<std::string_view, 6> kOut = {">", "[TX]", "TX", "TX:", "-->", "[TX]:"};
  if (std::find(kIn.begin(), kIn.end(), word) != kIn.end()) return 1;
  return std::find(kOut.begin(), kOut.end(), word) != kOut.end() ? 2 : 0;
}

Line read_line(std::string_view text) {
  Line line;
  while (text.ends_with('\r') || text.ends_with(' ')) text.remove_suffix(1);
  if (text == "*") return {LineKind::kRepeat, true, {}, 0, {}};
  strip_offset(text, line);
  const std::vector<std::string_view> words = words_of(text);
  for (const std::string_view word : words) line.direction = std::max(line.direction, direction_of(word));
  // A row of a table whose last column is a checksum.
  if (std::count_if(words.begin(), words.end(), is_decimal) > 1) return {};
  std::size_t begin = words.size();  // of the bytes, after time and mark
  while (begin > 0 && !byte_digits(words[begin - 1]).empty()) --begin;
  for (std::size_t i = begin; i < words.size(); ++i) {
    const std::string_view digits = byte_digits(words[i]);
    if (!line.offset && digits.size() != 2 && (digits.size() < 40 || words.size() > begin + 1)) return {};
    append(digits, line.bytes);
  }
  line.dumped = line.dumped || line.direction > 0 || (begin > 0 && line.bytes.size() > 1);
  if (text.find("length=") != std::string_view::npos && line.direction > 0) {
    line.kind = LineKind::kMark;
    line.bytes.clear();
  } else if (!line.bytes.empty() || line.offset) {
    line.kind = LineKind::kData;
  }
  return line;
}

struct Votes {
  std::size_t data = 0, other = 0, certain = 0, letters = 0;
};

}  // namespace

std::optional<Bytes> bytes_of_hex_dump(std::string_view text) {
  std::array<Bytes, 3> directions;
  Bytes previous;
  Votes votes;
  int direction = 0;
  bool repeats = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view raw = text.substr(0, end);
    text.remove_prefix(std::min(text.size(), end + 1));
    if (raw.empty() || raw == "\r") continue;
    Line line = read_line(raw);
    if (line.kind == LineKind::kOther) {
      // A program's first lines; and a text is known by its first kilobyte.
      if (++votes.other > 5 && 20 * votes.other > votes.data) return std::nullopt;
      continue;
    }
    if (line.direction > 0) direction = line.direction;
    votes.certain += line.dumped;
    if (line.kind == LineKind::kMark) continue;
    if (line.kind == LineKind::kRepeat) {
      repeats = true;
      continue;
    }
    ++votes.data;
    Bytes& bytes = directions[static_cast<std::size_t>(line.offset ? 0 : direction)];
    constexpr std::size_t kMostBytes = 1u << 30;
    while (repeats && line.offset && !previous.empty() && bytes.size() < std::min(*line.offset, kMostBytes))
      bytes.insert(bytes.end(), previous.begin(), previous.end());
    repeats = false;
    for (const std::uint8_t byte : line.bytes) votes.letters += byte % 16 > 9 || byte > 0x99;
    bytes.insert(bytes.end(), line.bytes.begin(), line.bytes.end());
    previous = std::move(line.bytes);
  }
  Bytes& most = *std::max_element(directions.begin(), directions.end(),
                                  [](const Bytes& a, const Bytes& b) { return a.size() < b.size(); });
  // Without a letter among the digits the text may be a table of decimal numbers.
  const bool is_dump = most.size() >= 16 && 10 * votes.data >= 9 * (votes.data + votes.other) &&
                       (votes.certain > 0 || votes.letters > 0) && votes.letters * 50 > most.size();
  if (!is_dump) return std::nullopt;
  return std::move(most);
}

std::string_view whole_part(std::string_view first) {
  if (const std::size_t end = first.rfind('\n'); end != std::string_view::npos) return first.substr(0, end + 1);
  if (const std::size_t end = first.find_last_of(" \t,;"); end != std::string_view::npos) return first.substr(0, end);
  return first.substr(0, first.size() / 2 * 2);
}

}  // namespace prism::drivers
