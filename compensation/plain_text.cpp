// SPDX-License-Identifier: MIT
#include "compensation/plain_text.hpp"

namespace prism {

std::string plain_text(std::string_view text, std::size_t most) {
  std::string result;
  for (const char c : text.substr(0, most)) result += c >= 0x20 && c <= 0x7e ? c : '?';
  return text.size() > most ? result + "..." : result;
}

}  // namespace prism
