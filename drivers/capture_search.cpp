// SPDX-License-Identifier: MIT
#include "drivers/capture_search.hpp"

#include <algorithm>
#include <vector>

#include "drivers/wire/description/field.hpp"

namespace prism::drivers {
namespace {

constexpr std::size_t kHeadBytes = kPacketHeaderBytes + kCaptureRecordBytes;
constexpr std::size_t kWindowBytes = 1 << 16;

// Both headers of a packet that ends within the `left` remaining bytes of the file.
bool begins_packet(const std::uint8_t* at, std::uint64_t left) {
  const std::uint64_t second = wire::load_little(at, 4), nanosecond = wire::load_little(at + 4, 4);
  const std::uint64_t kept = wire::load_little(at + 8, 4);
  if (kept != wire::load_little(at + 12, 4) || kept < kCaptureRecordBytes || kept > kMostPacketBytes) return false;
  if (nanosecond >= 1'000'000'000 || kPacketHeaderBytes + kept > left) return false;
  return is_own_record({at + kPacketHeaderBytes, kCaptureRecordBytes},
                       static_cast<std::int64_t>(second * 1'000'000'000 + nanosecond));
}

}  // namespace

bool is_own_record(std::span<const std::uint8_t> packet, std::int64_t time_ns) {
  if (packet.size() < kCaptureRecordBytes) return false;
  const auto expected = encode_capture_record(time_ns, CaptureEvent::kData);
  return std::equal(packet.begin(), packet.begin() + 8, expected.begin()) && packet[9] == 0 && packet[10] == 0 &&
         packet[11] == 0;
}

std::optional<std::uint64_t> find_packet(std::FILE* stream, std::uint64_t from, std::uint64_t size) {
  std::vector<std::uint8_t> window(kWindowBytes);
  for (; from + kHeadBytes <= size; from += kWindowBytes - kHeadBytes + 1) {
    if (std::fseek(stream, static_cast<long>(from), SEEK_SET) != 0) return std::nullopt;
    const std::size_t got = std::fread(window.data(), 1, window.size(), stream);
    for (std::size_t at = 0; at + kHeadBytes <= got; ++at) {
      if (begins_packet(window.data() + at, size - from - at)) return from + at;
    }
  }
  return std::nullopt;
}

}  // namespace prism::drivers
