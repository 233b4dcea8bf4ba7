// SPDX-License-Identifier: MIT
#include "drivers/wire/checksum.hpp"

namespace prism::wire {
namespace {

std::uint64_t load_word(const std::uint8_t* bytes, std::size_t available, int word, bool big_endian) {
  std::uint64_t value = 0;
  for (int i = 0; i < word; ++i) {
    const std::uint64_t byte = static_cast<std::size_t>(i) < available ? bytes[i] : 0;
    value |= byte << 8 * (big_endian ? word - 1 - i : i);
  }
  return value;
}

}  // namespace

std::uint64_t word_sum(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum += load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint64_t word_xor(std::span<const std::uint8_t> bytes, int word, bool big_endian) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += static_cast<std::size_t>(word)) {
    sum ^= load_word(bytes.data() + i, bytes.size() - i, word, big_endian);
  }
  return sum;
}

std::uint16_t fletcher_256(std::span<const std::uint8_t> bytes) {
  unsigned first = 0;
  unsigned second = 0;
  for (const std::uint8_t byte : bytes) {
    first = (first + byte) & 0xFF;
    second = (second + first) & 0xFF;
  }
  return static_cast<std::uint16_t>(first << 8 | second);
}

}  // namespace prism::wire
