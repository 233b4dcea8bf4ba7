// SPDX-License-Identifier: MIT
// One number in a frame: where its bits stand, how they are read and written.
#pragma once

#include <array>
#include <bit>
#include <boost/container/small_vector.hpp>
#include <cstdint>
#include <string>

#include "drivers/wire/description/conversion.hpp"

namespace prism::wire {

enum class NumberType {
  kUnsigned,
  kSigned,
  kFloat32,
  kFloat64,
  kDigits,       ///< characters at a place of their own: "00000235"
  kDecimalText,  ///< characters of a column
  kHexText
};

/// Says when a field is there: (value of another field % modulus) & mask is one of `values`.
struct Condition {
  int field = -1;  ///< index into FrameKind::fields, before the field that has the condition
  std::uint64_t modulus = 0;
  std::uint64_t mask = ~std::uint64_t{0};
  boost::container::small_vector<std::uint64_t, 1> values;
};

/// What the decoder touches for every frame comes first: one cache line for a field of whole numbers without scaling,
/// two for the others.
struct alignas(64) Field {
  int at = 0;     ///< first byte; negative: from the end of the frame. In an item: of its payload. Text: the column
  int item = -1;  ///< index into FrameKind::items.ids (or of the block); -1: at a place of its own
  NumberType type = NumberType::kUnsigned;
  std::uint8_t size = 1;        ///< bytes, 1 to 8
  std::uint8_t group_bits = 8;  ///< payload bits of each byte: 8, or 7 for the families that keep bit 7 clear
  std::uint8_t shift = 0;       ///< right shift of the assembled number
  std::uint8_t bits = 8;        ///< then this many bits; the sign is the highest of them
  bool plain_big = false;       ///< whole bytes in order: the quick ways
  bool plain_little = false;
  /// Offsets from `at`, most significant byte first: {0,1} big, {1,0} little, {1,2,0} as the device likes it.
  std::array<std::uint8_t, 8> order{};
  Condition when;
  Scaling scaling;
  double preset = 0;  ///< what an encoder writes where nothing else is known, as the raw number
  std::string name;
  std::string unit;
};

/// An unsigned whole number of `size` bytes (1 to 8); the common sizes without a loop.
inline std::uint64_t load_big(const std::uint8_t* first, unsigned size) {
  switch (size) {
    case 1:
      return first[0];
    case 2:
      return std::uint64_t{first[0]} << 8 | first[1];
    case 3:
      return std::uint64_t{first[0]} << 16 | std::uint64_t{first[1]} << 8 | first[2];
    case 4:
      return std::uint64_t{first[0]} << 24 | std::uint64_t{first[1]} << 16 | std::uint64_t{first[2]} << 8 | first[3];
    default:
      break;
  }
  std::uint64_t value = 0;
  for (unsigned i = 0; i < size; ++i) value = value << 8 | first[i];
  return value;
}

inline std::uint64_t load_little(const std::uint8_t* first, unsigned size) {
  switch (size) {
    case 1:
      return first[0];
    case 2:
      return std::uint64_t{first[1]} << 8 | first[0];
    case 4:
      return std::uint64_t{first[3]} << 24 | std::uint64_t{first[2]} << 16 | std::uint64_t{first[1]} << 8 | first[0];
    default:
      break;
  }
  std::uint64_t value = 0;
  for (unsigned i = size; i-- > 0;) value = value << 8 | first[i];
  return value;
}

/// All bits of the field's bytes, before shift and width are taken; `first` points to the byte that `at` names. Nothing
/// is checked against bounds here and below: the reader of descriptions and FrameView did.
inline std::uint64_t assembled(const Field& field, const std::uint8_t* first) {
  if (field.plain_big) return load_big(first, field.size);
  if (field.plain_little) return load_little(first, field.size);
  std::uint64_t value = 0;
  const unsigned low = (1u << field.group_bits) - 1;
  for (unsigned i = 0; i < field.size; ++i) value = value << field.group_bits | (first[field.order[i]] & low);
  return value;
}

/// The bits that the field names as an unsigned number; sign-extended to 64 bits for kSigned.
inline std::uint64_t load_bits(const Field& field, const std::uint8_t* first) {
  const unsigned unused = 64u - field.bits;
  const std::uint64_t value = (assembled(field, first) >> field.shift) << unused;
  if (field.type != NumberType::kSigned) return value >> unused;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(value) >> unused);
}

/// The number that the characters of a kDigits field print: blanks in front, a sign, digits, a point. kUnknown: none.
double load_digits(const Field& field, const std::uint8_t* first);

/// The raw number (before scaling) of a field at a place of its own.
inline double load_number(const Field& field, const std::uint8_t* first) {
  const std::uint64_t bits = load_bits(field, first);
  switch (field.type) {
    case NumberType::kSigned:
      return static_cast<double>(static_cast<std::int64_t>(bits));
    case NumberType::kFloat32:
      return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    case NumberType::kFloat64:
      return std::bit_cast<double>(bits);
    case NumberType::kDigits:
      return load_digits(field, first);
    default:
      return static_cast<double>(bits);
  }
}

/// Writes the lowest bits of `value` where load_bits reads them; other bits stay.
void store_bits(const Field& field, std::uint8_t* first, std::uint64_t value);

/// Writes a raw number, rounded to the nearest and held within what the field can say; NaN is written as 0.
/// Accumulated numbers wrap instead: use store_bits.
void store_number(const Field& field, std::uint8_t* first, double number);

}  // namespace prism::wire
