// SPDX-License-Identifier: MIT
#include "base/hex_bytes.hpp"

#include <algorithm>
#include <charconv>
#include <system_error>

namespace prism {

std::vector<std::uint8_t> hex_bytes(std::string_view text) {
  std::vector<std::uint8_t> result;
  while (!text.empty()) {
    if (text.front() == ' ') {
      text.remove_prefix(1);
      continue;
    }
    std::uint8_t byte = 0;
    const char* last = text.data() + std::min<std::size_t>(text.size(), 2);
    const auto [end, error] = std::from_chars(text.data(), last, byte, 16);
    if (error != std::errc{} || end != text.data() + 2) return {};
    result.push_back(byte);
    text.remove_prefix(2);
  }
  return result;
}

}  // namespace prism
