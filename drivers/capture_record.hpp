// SPDX-License-Identifier: MIT
// The first twelve bytes of every packet of a capture: libpcap's link type 250 (RTAC serial).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace prism::drivers {

inline constexpr int kCaptureLinkType = 250;
inline constexpr std::size_t kCaptureRecordBytes = 12;

enum class CaptureEvent {
  kOpened,  ///< the line was (re)opened: decoder and clock restart. In the file: status change, 0
  kData,    ///< bytes from the line. In the file: data received, 2
  kSent,    ///< bytes that prismd sent to the device. In the file: data sent, 1
  kOther,   ///< other records of a serial analyser: line errors
};

/// Seconds and microseconds (u32 big-endian each), event type, control lines (0), two zero bytes. `event` is not
/// kOther. Other programs use this time; prism uses the nanoseconds of the packet's pcap header.
inline std::array<std::uint8_t, kCaptureRecordBytes> encode_capture_record(std::int64_t time_ns, CaptureEvent event) {
  const auto second = static_cast<std::uint32_t>(time_ns / 1'000'000'000);
  const auto microsecond = static_cast<std::uint32_t>(time_ns % 1'000'000'000 / 1000);
  std::array<std::uint8_t, kCaptureRecordBytes> bytes{};
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[i] = static_cast<std::uint8_t>(second >> (24 - 8 * i));
    bytes[4 + i] = static_cast<std::uint8_t>(microsecond >> (24 - 8 * i));
  }
  bytes[8] = event == CaptureEvent::kOpened ? 0 : event == CaptureEvent::kSent ? 1 : 2;
  return bytes;
}

/// The event of a packet; nullopt if it is too short for a record.
inline std::optional<CaptureEvent> decode_capture_event(std::span<const std::uint8_t> packet) {
  if (packet.size() < kCaptureRecordBytes) return std::nullopt;
  constexpr CaptureEvent kEvents[] = {CaptureEvent::kOpened, CaptureEvent::kSent, CaptureEvent::kData};
  return packet[8] < 3 ? kEvents[packet[8]] : CaptureEvent::kOther;
}

}  // namespace prism::drivers
