// SPDX-License-Identifier: MIT
// Character format of a serial line: speed, bits, parity, and the time of one byte.
#pragma once

#include <array>
#include <cstddef>

namespace prism::wire {

/// Maximum number of input axes of a device.
inline constexpr std::size_t kMaxAxes = 4;
/// Maximum number of additional channels of a device.
inline constexpr std::size_t kMaxSensors = 16;

enum class Parity { kNone, kEven, kOdd };
inline constexpr std::array kParities = {"none", "even", "odd"};

struct WireFormat {
  int baud = 921600;  ///< 50 to 20 000 000; any integer, not only standard speeds
  int data_bits = 8;  ///< 7 or 8
  Parity parity = Parity::kNone;
  int stop_bits = 1;  ///< 1 or 2

  /// Bits that one byte occupies on the line, with start, parity and stop bits.
  int bits_per_byte() const { return 1 + data_bits + (parity == Parity::kNone ? 0 : 1) + stop_bits; }
  /// Time that one byte occupies on the line, ns.
  double byte_time_ns() const { return 1e9 * bits_per_byte() / baud; }

  bool operator==(const WireFormat&) const = default;
};

}  // namespace prism::wire
