// SPDX-License-Identifier: MIT
#include "drivers/shown_bytes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/escape.hpp"

namespace prism::drivers {
namespace {

constexpr std::string_view kDigits = "0123456789", kHexDigits = "0123456789ABCDEFabcdef", kBlanks = " \t,;";

bool consists_of(std::string_view text, std::string_view characters) {
  return !text.empty() && text.find_first_not_of(characters) == std::string_view::npos;
}

/// The digits of "A5", "0xA5", "A5h" and of a long run; with an offset before them also of "a55a". Empty: no bytes.
std::string_view digits_of(std::string_view word, bool has_offset) {
  if (word.starts_with("0x") || word.starts_with("0X")) word.remove_prefix(2);
  if (word.size() == 3 && (word.ends_with('h') || word.ends_with('H'))) word.remove_suffix(1);
  const bool is_length = word.size() == 2 || word.size() >= 40 || has_offset;
  return is_length && word.size() % 2 == 0 && consists_of(word, kHexDigits) ? word : std::string_view();
}

struct Lines {
  std::size_t count = 0, dumped = 0, sentences = 0, stamped = 0;
  std::size_t digits = 0, letters = 0;  ///< of the dumped lines; without a letter, they may be decimal numbers
};

void count_sentence(std::string_view line, Lines& lines) {
  const std::size_t begin = line.find_first_of("$!#%"), star = line.rfind('*');
  if (star == std::string_view::npos || begin > star || !consists_of(line.substr(star + 1), kHexDigits)) return;
  ++lines.sentences;
  lines.stamped += begin > 0;
}

/// Bytes follow an offset ("00000010: "), or end a line behind stamps and marks.
void count_dump(std::string_view line, Lines& lines) {
  const std::size_t end = line.find_first_not_of(kHexDigits);
  const bool has_offset = end >= 6 && end <= 16 && (line[end] == ':' || line.substr(end).starts_with("  "));
  if (has_offset) line.remove_prefix(end + 1);
  std::size_t digits = 0, letters = 0, words = 0, decimals = 0;
  while (!line.empty()) {
    const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
    line.remove_prefix(std::min(word.size() + 1, line.size()));
    if (word.empty()) continue;
    const std::string_view found = digits_of(word, has_offset);
    if (found.empty() && has_offset) break;  // the column of characters
    ++words;
    decimals += word.find('.') != std::string_view::npos && consists_of(word, "0123456789.-");
    digits = found.empty() ? 0 : digits + found.size();
    letters =
        found.empty() ? 0 : letters + static_cast<std::size_t>(std::count_if(found.begin(), found.end(), [](char c) {
                              return kDigits.find(c) == std::string_view::npos;
                            }));
  }
  if (digits == 0 || (digits == 2 && words > 1) || decimals > 1) return;  // a row of a table, with a check at its end
  ++lines.dumped;
  lines.digits += digits;
  lines.letters += letters;
}

Lines lines_of(std::string_view text) {
  Lines lines;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    while (line.ends_with('\r') || line.ends_with(' ')) line.remove_suffix(1);
    // Of dumps: a repetition, an offset at the end, and the lines between those of bytes that socat writes.
    const bool is_offset = line.size() >= 6 && line.size() <= 16 && consists_of(line, kHexDigits);
    if (line.empty() || line == "*" || is_offset || line.find(" length=") != std::string_view::npos) continue;
    ++lines.count;
    count_sentence(line, lines);
    count_dump(line, lines);
  }
  return lines;
}

}  // namespace

bool is_binary(std::string_view first) {
  const auto control = std::count_if(first.begin(), first.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t' && c != '\f';
  });
  return static_cast<std::size_t>(control) * 20 > first.size();
}

Result<bool> has_sentences(const std::string& path, std::string_view first) {
  if (is_binary(first)) return false;
  if (first.size() >= kFirstBytes) {  // may end within a line, or within a word of a single line
    const std::size_t end = first.rfind('\n');
    first = first.substr(0, end != std::string_view::npos ? end : first.find_last_of(kBlanks));
  }
  const Lines lines = lines_of(first);
  // Besides the first line, which a program may add.
  const auto in_most = [&](std::size_t count) { return count > 1 && 10 * (count + 1) >= 9 * lines.count; };
  const bool is_dump =
      (in_most(lines.dumped) || lines.count == 1) && lines.digits >= 32 && 100 * lines.letters > lines.digits;
  const bool is_log = in_most(lines.sentences) && 2 * lines.stamped > lines.sentences;
  if (is_dump || is_log)
    return make_error(path, fmt::format("found a {}, expected the bytes of the line; prism-import {} --hex --out "
                                        "line.bin writes them",
                                        is_dump ? "hex dump" : "log of sentences", shell_word(path)));
  return in_most(lines.sentences);
}

}  // namespace prism::drivers
