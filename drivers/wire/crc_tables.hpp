// SPDX-License-Identifier: MIT
// A CRC through tables, on any processor.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/wire/crc_bits.hpp"

namespace prism {

/// Eight bytes a step (Kounavis and Berry 2005, slicing-by-8), 16 KiB.
class CrcTables {
 public:
  explicit CrcTables(CrcPolynomial polynomial);

  std::uint64_t update(std::uint64_t state, std::span<const std::uint8_t> bytes) const;

 private:
  bool reflected_;
  std::array<std::array<std::uint64_t, 256>, 8> table_{};  ///< [k][b]: byte b with k zero bytes behind it
};

}  // namespace prism
