// SPDX-License-Identifier: MIT
// Where the next packet begins behind damage: prism's packets say their time twice, which nothing else does by chance.
#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>

#include "drivers/capture_record.hpp"

namespace prism::drivers {

inline constexpr std::size_t kPacketHeaderBytes = 16;
/// A packet is believed to hold this much at most: what libpcap reads.
inline constexpr std::uint32_t kMostPacketBytes = 262144;

/// The record at the head of a packet repeats the time of the packet's header, to the microsecond, and its last bytes
/// are zero: prism wrote it.
bool is_own_record(std::span<const std::uint8_t> packet, std::int64_t time_ns);

/// The offset of the first whole packet of prism's at or after `from`, in a little-endian pcap file with nanoseconds of
/// `size` bytes. Nothing: there is none. Moves the stream.
std::optional<std::uint64_t> find_packet(std::FILE* stream, std::uint64_t from, std::uint64_t size);

}  // namespace prism::drivers
