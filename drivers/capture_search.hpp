// SPDX-License-Identifier: MIT
// Finds the next packet after damage: packets of prism contain their time twice, which random bytes do not.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>

#include "drivers/capture_record.hpp"

namespace prism::drivers {

inline constexpr std::size_t kPacketHeaderBytes = 16;
/// Maximum size of a valid packet: libpcap's limit.
inline constexpr std::uint32_t kMostPacketBytes = 262144;

/// True if prism wrote the packet: the record at its start repeats the time of the packet's header to the microsecond,
/// and its last bytes are zero.
bool is_own_record(std::span<const std::uint8_t> packet, std::int64_t time_ns);

/// Offset of the first complete packet of prism at or after `from`, in a little-endian nanosecond pcap file of `size`
/// bytes. Returns nullopt without one. Moves the stream.
std::optional<std::uint64_t> find_packet(std::FILE* stream, std::uint64_t from, std::uint64_t size);

}  // namespace prism::drivers
