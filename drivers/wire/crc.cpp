// SPDX-License-Identifier: MIT
// What a CRC begins and ends with, and the way between.
#include "drivers/wire/crc.hpp"

namespace prism {
namespace {

std::uint64_t mask_of(int width) { return ~std::uint64_t{0} >> (64 - width); }

/// `width` bits where a state of that width stands.
std::uint64_t aligned(const CrcParameters& parameters, std::uint64_t bits) {
  const int width = parameters.width;
  return parameters.reflect_in ? reversed(bits, width) : bits << (64 - width);
}

CrcPolynomial polynomial_of(const CrcParameters& parameters) {
  return {aligned(parameters, parameters.poly), parameters.reflect_in};
}

}  // namespace

Crc::Crc(const CrcParameters& parameters, Way way)
    : parameters_(parameters),
      start_(aligned(parameters, parameters.init)),
      mask_(mask_of(parameters.width)),
      product_(polynomial_of(parameters)) {
  if (way == Way::kBest && CrcProduct::possible()) return;
  tables_ = std::make_unique<const CrcTables>(polynomial_of(parameters));
}

[[gnu::hot]] std::uint64_t Crc::update(std::uint64_t state, std::span<const std::uint8_t> bytes) const {
  return tables_ ? tables_->update(state, bytes) : product_.update(state, bytes);
}

[[gnu::hot]] std::uint64_t Crc::finish(std::uint64_t state) const {
  const int width = parameters_.width;
  if (!parameters_.reflect_in) state >>= 64 - width;
  if (parameters_.reflect_in != parameters_.reflect_out) state = reversed(state, width);
  return (state ^ parameters_.xor_out) & mask_;
}

}  // namespace prism
