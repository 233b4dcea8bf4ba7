// SPDX-License-Identifier: MIT
// Unsigned integers of equal width, packed into words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace prism::recordings {

class PackedBits {
 public:
  PackedBits() = default;
  /// `count` zeros of `bits` bits (0 to 64).
  PackedBits(std::size_t count, unsigned bits)
      : words_((count * bits + 63) / 64 + 2), mask_(bits == 0 ? 0 : ~std::uint64_t{0} >> (64 - bits)), bits_(bits) {}

  /// The element must be 0. `value` must have no other bits.
  void set(std::size_t index, std::uint64_t value) {
    const std::size_t at = index * bits_, word = at / 64, shift = at % 64;
    words_[word] |= value << shift;
    words_[word + 1] |= value >> 1 >> (63 - shift);  // in two steps: a shift by 64 is undefined
  }
  std::uint64_t operator[](std::size_t index) const {
    const std::size_t at = index * bits_, word = at / 64, shift = at % 64;
    return (words_[word] >> shift | words_[word + 1] << 1 << (63 - shift)) & mask_;
  }
  std::uint64_t largest() const { return mask_; }  ///< the largest integer

 private:
  std::vector<std::uint64_t> words_;  ///< the last two may be read, and are not used
  std::uint64_t mask_ = 0;
  unsigned bits_ = 0;
};

}  // namespace prism::recordings
