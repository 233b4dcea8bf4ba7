// SPDX-License-Identifier: MIT
// One number in a frame: position of its bits, how they are read and written.
#pragma once

#include <array>
#include <bit>
#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace prism::wire {

// Converts a number on the wire to its quantity: linear, table, bridge, PT100.

struct ConversionStep {
  enum class Kind {
    kTable,    ///< linear interpolation between points (x strictly increasing, y strictly monotonic)
    kBridge,   ///< ratiometric bridge: y = reference x / (full - x), x from 0 to below full
    kPlatinum  ///< platinum resistor, IEC 60751: x ohm in, degC out, -200 to 850 degC
  } kind = Kind::kTable;
  std::vector<double> x = {}, y = {};  ///< kTable
  double full = 1, reference = 1;      ///< kBridge
  double r0_ohm = 100;                 ///< kPlatinum
};

/// One step forward; NaN if x is outside the range of the step.
double convert(const ConversionStep& step, double x);
/// The x that convert() maps to y; NaN if there is no such x.
double convert_back(const ConversionStep& step, double y);

/// IEC 60751: resistance of a platinum resistor at a temperature, and back (error below 1e-6 degC from -200 to 850).
double platinum_ohm(double temperature_degc, double r0_ohm);
double platinum_degc(double resistance_ohm, double r0_ohm);

/// number = raw * scale + offset, then the steps in order, then the range.
struct Conversion {
  double scale = 1;
  double offset = 0;
  double min = -1e300;  ///< of the result; outside, or if it is not finite, the value is unknown
  double max = 1e300;
  std::vector<ConversionStep> steps;

  /// Without the range check.
  double apply(double raw) const {
    double value = raw * scale + offset;
    for (const ConversionStep& step : steps) value = convert(step, value);
    return value;
  }
  /// Inverse of apply: the raw number, not rounded; NaN if it does not exist.
  double invert(double value) const {
    for (std::size_t i = steps.size(); i-- > 0;) value = convert_back(steps[i], value);
    return (value - offset) / scale;
  }
  bool admits(double value) const { return value >= min && value <= max; }
};

enum class NumberType {
  kUnsigned,
  kSigned,
  kFloat32,
  kFloat64,
  kDigits,       ///< characters at a fixed position: "00000235"
  kDecimalText,  ///< characters of a column
  kHexText
};

/// Condition for the presence of a field: (value of another field % modulus) & mask is one of `values`.
struct Condition {
  int field = -1;  ///< index into MessageType::fields, before the conditional field
  std::uint64_t modulus = 0;
  std::uint64_t mask = ~std::uint64_t{0};
  boost::container::small_vector<std::uint64_t, 1> values;
};

/// The members used for every frame come first: one cache line for an unscaled integer field, two for the others.
struct alignas(64) Field {
  int at = 0;     ///< first byte; negative: from the end of the frame. In an item: of its payload. Text: the column
  int item = -1;  ///< index into MessageType::items.ids (or of the block); -1: at a fixed position
  NumberType type = NumberType::kUnsigned;
  std::uint8_t size = 1;        ///< bytes, 1 to 8; hexadecimal digits: 1 to 16 characters
  std::uint8_t group_bits = 8;  ///< payload bits of each byte: 8; 7: bit 7 is always clear; 4: a hexadecimal digit
  std::uint8_t shift = 0;       ///< right shift of the assembled number
  std::uint8_t bits = 8;        ///< then this many bits; the highest is the sign
  bool plain_big = false;       ///< complete bytes in order: allows the fast functions
  bool plain_little = false;
  bool is_direct = false;  ///< in every frame, in its bytes, at a fixed position from the start: needs no search
  /// Offsets from `at`, most significant byte first: {0,1} big, {1,0} little, {1,2,0} device-specific.
  std::array<std::uint8_t, 8> order{};
  Condition when;
  Conversion scaling;
  double preset = 0;  ///< default raw number for an encoder
  int decimals = -1;  ///< kDecimalText: exact number of digits after the point, or the frame is rejected; -1: any
  std::string name;
  std::string unit;

  /// The number is printed in hexadecimal digits, most significant first: "FFE3".
  bool is_hex() const { return group_bits == 4; }
};

/// An unsigned integer of `size` bytes (1 to 8); common sizes without a loop.
inline std::uint64_t load_big(const std::uint8_t* first, unsigned size) {
  const auto four = [](const std::uint8_t* b) {
    return std::uint64_t{b[0]} << 24 | std::uint64_t{b[1]} << 16 | std::uint64_t{b[2]} << 8 | b[3];
  };
  switch (size) {
    case 1:
      return first[0];
    case 2:
      return std::uint64_t{first[0]} << 8 | first[1];
    case 3:
      return std::uint64_t{first[0]} << 16 | std::uint64_t{first[1]} << 8 | first[2];
    case 4:
      return four(first);
    case 8:
      return four(first) << 32 | four(first + 4);
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
    case 8:
      return load_little(first + 4, 4) << 32 | load_little(first, 4);
    default:
      break;
  }
  std::uint64_t value = 0;
  for (unsigned i = size; i-- > 0;) value = value << 8 | first[i];
  return value;
}

/// True if `size` characters are hexadecimal digits.
bool are_hex_digits(const std::uint8_t* first, unsigned size);

/// The number in hexadecimal digits; call only if are_hex_digits().
std::uint64_t load_hex(const std::uint8_t* first, unsigned size);

/// All bits of the field's bytes, before shift and width are applied; `first` points to the byte at `at`. No bounds
/// checks here and below: the description reader and FrameView have done them.
inline std::uint64_t assembled(const Field& field, const std::uint8_t* first) {
  if (field.plain_big) return load_big(first, field.size);
  if (field.plain_little) return load_little(first, field.size);
  if (field.is_hex()) return load_hex(first, field.size);
  std::uint64_t value = 0;
  const unsigned low = (1u << field.group_bits) - 1;
  for (unsigned i = 0; i < field.size; ++i) value = value << field.group_bits | (first[field.order[i]] & low);
  return value;
}

/// The bits of the field as an unsigned number; sign-extended to 64 bits for kSigned.
inline std::uint64_t load_bits(const Field& field, const std::uint8_t* first) {
  const unsigned unused = 64u - field.bits;
  const std::uint64_t value = (assembled(field, first) >> field.shift) << unused;
  if (field.type != NumberType::kSigned) return value >> unused;
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(value) >> unused);
}

/// The number in the characters of a kDigits field: leading blanks, a sign, digits, a point. kUnknown if invalid.
double load_digits(const Field& field, const std::uint8_t* first);

/// The raw number (before scaling) of a field at a fixed position.
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

/// Writes the lowest `size` bytes of an unsigned integer (1 to 8); common sizes without a loop.
inline void store_big(std::uint8_t* first, unsigned size, std::uint64_t value) {
  const auto put = [&](unsigned i, unsigned shift) { first[i] = static_cast<std::uint8_t>(value >> shift); };
  switch (size) {
    case 1:
      return put(0, 0);
    case 2:
      return put(0, 8), put(1, 0);
    case 4:
      return put(0, 24), put(1, 16), put(2, 8), put(3, 0);
    case 8:
      return put(0, 56), put(1, 48), put(2, 40), put(3, 32), put(4, 24), put(5, 16), put(6, 8), put(7, 0);
    default:
      for (unsigned i = 0; i < size; ++i) put(i, 8 * (size - 1 - i));
  }
}

/// The same for a part of the bits of a field's bytes, and for bytes that are not in order.
void store_bits_within(const Field& field, std::uint8_t* first, std::uint64_t value);

/// Writes the lowest bits of `value` at the position that load_bits reads; other bits are unchanged.
inline void store_bits(const Field& field, std::uint8_t* first, std::uint64_t value) {
  if (field.plain_big && field.bits == 8u * field.size) return store_big(first, field.size, value);
  if (field.plain_big && field.size == 1) {
    const unsigned mask = 0xFFu >> (8u - field.bits) << field.shift;
    *first = static_cast<std::uint8_t>((*first & ~mask) | (value << field.shift & mask));
    return;
  }
  store_bits_within(field, first, value);
}

/// Writes a raw number, rounded to the nearest and limited to the field's range; NaN is written as 0. Accumulated
/// numbers wrap instead: use store_bits.
void store_number(const Field& field, std::uint8_t* first, double number);

// Parses numbers printed by a device.

/// Blanks around it, a sign, digits, `point` before the decimals, and an exponent (e or E, a sign, digits). Returns
/// kUnknown if the text is anything else or the number is outside the range of a double.
double parse_decimal(std::string_view text, char point);

}  // namespace prism::wire
