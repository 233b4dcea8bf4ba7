// SPDX-License-Identifier: MIT
#include "drivers/text_log.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "base/hex_bytes.hpp"

namespace prism::drivers {
namespace {

/// The sentence at the end of a line; empty: none.
std::string_view sentence_of(std::string_view line) {
  const std::size_t star = line.rfind('*');
  if (star == std::string_view::npos) return {};
  std::size_t begin = line.rfind('$', star);
  if (begin == std::string_view::npos) begin = std::min(line.find_first_of("!#%"), star);
  const std::string_view digits = line.substr(star + 1), body = line.substr(begin, star - begin);
  const std::vector<std::uint8_t> check = hex_bytes(digits);
  if (body.size() < 2 || digits.size() != 2 * check.size() ||
      (check.size() != 1 && check.size() != 2 && check.size() != 4))
    return {};
  unsigned sum = 0;
  for (const char c : body.substr(1)) sum ^= static_cast<unsigned char>(c);
  if (check.size() == 1 && check[0] != sum) return {};
  return line.substr(begin);
}

struct Sentences {
  std::vector<std::uint8_t> bytes;  ///< each with CR LF
  std::size_t count = 0, others = 0, changed = 0;
  bool in_most_lines() const { return count >= 2 && count >= 9 * others; }
};

Sentences sentences_in(std::string_view text) {
  Sentences found;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) break;
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    const bool has_cr = line.ends_with('\r');
    if (has_cr) line.remove_suffix(1);
    if (line.empty()) continue;
    const std::string_view sentence = sentence_of(line);
    if (sentence.empty()) {
      // A program's first lines, and damaged ones; another text is known by its first kilobyte.
      if (++found.others > 5 && 10 * found.others > found.count) return {};
      continue;
    }
    ++found.count;
    found.changed += !has_cr || sentence.size() < line.size();
    found.bytes.insert(found.bytes.end(), sentence.begin(), sentence.end());
    found.bytes.insert(found.bytes.end(), {'\r', '\n'});
  }
  return found;
}

}  // namespace

std::optional<std::vector<std::uint8_t>> bytes_of_text_log(std::string_view text) {
  Sentences found = sentences_in(text);
  if (!found.in_most_lines() || 2 * found.changed < found.count) return std::nullopt;
  return std::move(found.bytes);
}

bool is_text_log(std::string_view text) { return sentences_in(text).in_most_lines(); }

}  // namespace prism::drivers
