// SPDX-License-Identifier: MIT
// Cyclic redundancy checks of any width and reflection.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "drivers/wire/crc_product.hpp"
#include "drivers/wire/crc_tables.hpp"

namespace prism {

/// The parameters of Ross Williams' model (A Painless Guide to CRC Error Detection Algorithms, 1993).
struct CrcParameters {
  int width = 16;               ///< bits, 3 to 64
  std::uint64_t poly = 0x1021;  ///< without the leading one, not reflected
  std::uint64_t init = 0;
  bool reflect_in = false;
  bool reflect_out = false;
  std::uint64_t xor_out = 0;
};

/// Eight bytes a step: by carry-less products where the processor has them, else through tables of 16 KiB. Both give
/// the same. Immutable: one object serves every thread.
class Crc {
 public:
  enum class Way { kBest, kTables };

  explicit Crc(const CrcParameters& parameters, Way way = Way::kBest);

  std::uint64_t compute(std::span<const std::uint8_t> bytes) const { return finish(update(start(), bytes)); }

  /// In pieces: start, any number of updates, finish.
  std::uint64_t start() const { return start_; }
  std::uint64_t update(std::uint64_t state, std::span<const std::uint8_t> bytes) const;
  std::uint64_t finish(std::uint64_t state) const;

  const CrcParameters& parameters() const { return parameters_; }

 private:
  CrcParameters parameters_;
  std::uint64_t start_ = 0;
  std::uint64_t mask_ = 0;
  CrcProduct product_;
  std::unique_ptr<const CrcTables> tables_;  ///< null where product_ does the work
};

}  // namespace prism
