// SPDX-License-Identifier: MIT
// One number in a frame: where its bits stand, how they are read and written.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/wire/conversion.hpp"

namespace prism {

enum class NumberType { kUnsigned, kSigned, kFloat32, kFloat64, kDecimalText, kHexText };

/// Says when a field is there: (value of another field % modulus) & mask is one of `values`.
struct Condition {
  int field = -1;  ///< index into FrameKind::fields, before the field that has the condition
  std::uint64_t modulus = 0;
  std::uint64_t mask = ~std::uint64_t{0};
  std::vector<std::uint64_t> values;
};

struct Field {
  std::string name;
  std::string unit;
  NumberType type = NumberType::kUnsigned;
  int at = 0;      ///< first byte; negative: from the end of the frame. In an item: of its payload. Text: the column
  std::uint8_t size = 1;        ///< bytes, 1 to 8
  std::uint8_t group_bits = 8;  ///< payload bits of each byte: 8, or 7 for the families that keep bit 7 clear
  std::uint8_t shift = 0;       ///< right shift of the assembled number
  std::uint8_t bits = 8;        ///< then this many bits; the sign is the highest of them
  /// Offsets from `at`, most significant byte first: {0,1} big, {1,0} little, {1,2,0} as the device likes it.
  std::array<std::uint8_t, 8> order{};
  bool plain_big = false;     ///< whole bytes, big-endian: the quick ways
  bool plain_little = false;
  Scaling scaling;
  Condition when;
  int item = -1;  ///< index into FrameKind::items.ids; -1: at a place of its own
  double preset = 0;  ///< what an encoder writes where nothing else is known, as the raw number
};

/// The bits as an unsigned number, sign-extended to 64 bits for kSigned; `base` points to the frame's (or item's) byte
/// that `at` 0 names. No bounds are checked here: the reader of descriptions and the matcher did.
std::uint64_t load_bits(const Field& field, const std::uint8_t* first);

/// The raw number (before scaling) of a binary field.
double load_number(const Field& field, const std::uint8_t* first);

/// Writes the lowest bits of `value` where load_bits reads them; other bits stay.
void store_bits(const Field& field, std::uint8_t* first, std::uint64_t value);

/// Writes a raw number, rounded to the nearest and held within what the field can say. Returns what was written.
double store_number(const Field& field, std::uint8_t* first, double number);

}  // namespace prism
