// SPDX-License-Identifier: MIT
#include "drivers/text_log.hpp"

#include <algorithm>
#include <cstddef>

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

}  // namespace

std::optional<std::vector<std::uint8_t>> bytes_of_text_log(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  std::size_t sentences = 0, others = 0, changed = 0;
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
      if (++others > 5 && 10 * others > sentences) return std::nullopt;
      continue;
    }
    ++sentences;
    changed += !has_cr || sentence.size() < line.size();
    bytes.insert(bytes.end(), sentence.begin(), sentence.end());
    bytes.insert(bytes.end(), {'\r', '\n'});
  }
  if (sentences < 2 || sentences < 9 * others || 2 * changed < sentences) return std::nullopt;
  return bytes;
}

}  // namespace prism::drivers
