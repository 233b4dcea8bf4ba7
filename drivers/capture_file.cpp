// SPDX-License-Identifier: MIT
#include "drivers/capture_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pcap/pcap.h>
#include <stdio_ext.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "drivers/shown_bytes.hpp"
#include "drivers/wire/description/field.hpp"

namespace prism::drivers {
namespace {

constexpr std::size_t kReadBytes = 1 << 18;
constexpr std::size_t kMostBareBytes = 1024;
constexpr double kMostBareSeconds = 0.010;  // below the decoder's time-out, so that no frame counts as truncated
constexpr std::size_t kPcapHeaderBytes = 24, kPacketHeaderBytes = 16;
constexpr std::uint32_t kMostPacketBytes = 262144;  // of a valid packet: libpcap's limit
constexpr std::size_t kMostBytes = 65536;           // of the line in one packet; longer chunks are split
constexpr std::size_t kWriteBytes = 1 << 18;

// The first twelve bytes of every packet of a capture: libpcap's link type 250 (RTAC serial).
constexpr int kCaptureLinkType = 250;
constexpr std::size_t kCaptureRecordBytes = 12;

// The magics of pcap (micro- and nanoseconds, both byte orders) and of pcapng, as stored in the file.
bool is_pcap_magic(std::span<const std::uint8_t> first) {
  constexpr std::array<std::array<std::uint8_t, 4>, 5> kMagics{{{0xD4, 0xC3, 0xB2, 0xA1},
                                                                {0xA1, 0xB2, 0xC3, 0xD4},
                                                                {0x4D, 0x3C, 0xB2, 0xA1},
                                                                {0xA1, 0xB2, 0x3C, 0x4D},
                                                                {0x0A, 0x0D, 0x0D, 0x0A}}};
  return std::any_of(kMagics.begin(), kMagics.end(), [&](const auto& magic) {
    return first.size() >= 4 && std::equal(magic.begin(), magic.end(), first.begin());
  });
}

// pcap in this machine's byte order; the magic number identifies it and nanosecond times.
struct FileHeader {
  std::uint32_t magic = 0xa1b23c4d;
  std::uint16_t major = 2, minor = 4;
  std::uint32_t zone = 0, accuracy = 0;
  std::uint32_t most_bytes = kMostBytes + kCaptureRecordBytes;
  std::uint32_t link_type = kCaptureLinkType;
};
struct PacketHeader {
  std::uint32_t seconds, nanoseconds, bytes, original_bytes;
};

/// Seconds and microseconds (u32 big-endian each), event type, control lines (0), two zero bytes. `event` is not
/// kOther. Other programs use this time; prism uses the nanoseconds of the packet's pcap header.
std::array<std::uint8_t, kCaptureRecordBytes> encode_capture_record(std::int64_t time_ns, CaptureEvent event) {
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
std::optional<CaptureEvent> decode_capture_event(std::span<const std::uint8_t> packet) {
  if (packet.size() < kCaptureRecordBytes) return std::nullopt;
  constexpr CaptureEvent kEvents[] = {CaptureEvent::kOpened, CaptureEvent::kSent, CaptureEvent::kData};
  return packet[8] < 3 ? kEvents[packet[8]] : CaptureEvent::kOther;
}

// Finds the next packet after damage: packets of prism contain their time twice, which random bytes do not.

constexpr std::size_t kHeadBytes = kPacketHeaderBytes + kCaptureRecordBytes;
constexpr std::size_t kWindowBytes = 1 << 16;

/// True if prism wrote the packet: the record at its start repeats the time of the packet's header to the microsecond,
/// and its last bytes are zero.
bool is_own_record(std::span<const std::uint8_t> packet, std::int64_t time_ns) {
  if (packet.size() < kCaptureRecordBytes) return false;
  const auto expected = encode_capture_record(time_ns, CaptureEvent::kData);
  return std::equal(packet.begin(), packet.begin() + 8, expected.begin()) && packet[9] == 0 && packet[10] == 0 &&
         packet[11] == 0;
}

// Both headers of a packet that ends within the `left` remaining bytes of the file.
bool begins_packet(const std::uint8_t* at, std::uint64_t left) {
  const std::uint64_t second = wire::load_little(at, 4), nanosecond = wire::load_little(at + 4, 4);
  const std::uint64_t kept = wire::load_little(at + 8, 4);
  if (kept != wire::load_little(at + 12, 4) || kept < kCaptureRecordBytes || kept > kMostPacketBytes) return false;
  if (nanosecond >= 1'000'000'000 || kPacketHeaderBytes + kept > left) return false;
  return is_own_record({at + kPacketHeaderBytes, kCaptureRecordBytes},
                       static_cast<std::int64_t>(second * 1'000'000'000 + nanosecond));
}

/// Offset of the first complete packet of prism at or after `from`, in a little-endian nanosecond pcap file of `size`
/// bytes. Returns nullopt without one. Moves the stream.
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

}  // namespace

CaptureReader::CaptureReader(std::string path, std::optional<double> bytes_per_s)
    : path_(std::move(path)), bytes_per_s_(bytes_per_s) {}

void CaptureReader::ClosePcap::operator()(pcap* file) const { pcap_close(file); }

std::uint64_t CaptureReader::position_bytes() const {
  const long at = std::ftell(stream_);
  return at < 0 ? 0 : static_cast<std::uint64_t>(at);
}

Result<void> CaptureReader::open_stream() {
  if (auto failed = take(own_stream_, open_input_stream(path_))) return *failed;
  stream_ = own_stream_.get();
  struct stat status {};
  if (::fstat(fileno(stream_), &status) != 0) return make_error(path_, "cannot be read");
  size_ = static_cast<std::uint64_t>(status.st_size);
  buffer_.resize(kReadBytes);
  std::setvbuf(stream_, buffer_.data(), _IOFBF, buffer_.size());
  __fsetlocking(stream_, FSETLOCKING_BYCALLER);  // one thread reads
  return {};
}

Result<void> CaptureReader::open_pcap(std::size_t first_bytes) {
  if (first_bytes < kPcapHeaderBytes) {  // capture truncated at its start: it is empty
    damage_ = fmt::format("{}: truncated in the file header, at byte {}", path_, first_bytes);
    ended_ = true;
    return {};
  }
  char why[PCAP_ERRBUF_SIZE] = "";
  pcap_.reset(pcap_fopen_offline_with_tstamp_precision(stream_, PCAP_TSTAMP_PRECISION_NANO, why));
  if (!pcap_) return make_error(path_, fmt::format("found a damaged pcap file ({}), expected a capture", why));
  (void)own_stream_.release();  // pcap closes it
  const int link = pcap_datalink(pcap_.get());
  if (link == kCaptureLinkType) return {};
  const char* name = pcap_datalink_val_to_name(link);
  return make_error(
      path_, fmt::format("found a capture of link type {} ({}), expected {} (serial line); to extract bytes of TCP: "
                         "tshark -r FILE -Y tcp.payload -T fields -e tcp.payload | xxd -r -p >BYTES",
                         link, name ? name : "unknown", kCaptureLinkType));
}

Result<void> CaptureReader::open_bare() {
  const double most = std::clamp(*bytes_per_s_ * kMostBareSeconds, 1.0, static_cast<double>(kMostBareBytes));
  bytes_.resize(static_cast<std::size_t>(most));
  std::array<char, kFirstBytes> first;
  const std::size_t got = std::fread(first.data(), 1, first.size(), stream_);
  std::rewind(stream_);
  const auto checked = has_sentences(path_, {first.data(), got});
  return checked ? Result<void>() : tl::unexpected<Error>(checked.error());
}

std::optional<CapturePacket> CaptureReader::next_bare() {
  const std::size_t got = std::fread(bytes_.data(), 1, bytes_.size(), stream_);
  if (got == 0) {
    if (std::ferror(stream_)) damage_ = fmt::format("{}: {} at byte {}", path_, std::strerror(errno), bare_position_);
    return std::nullopt;
  }
  bare_position_ += got;
  const double seconds = static_cast<double>(bare_position_) / *bytes_per_s_;
  return CapturePacket{std::llround(seconds * 1e9), CaptureEvent::kData, {bytes_.data(), got}};
}

/// Continues at the next packet written by prism, or returns false.
bool CaptureReader::resume() {
  const auto found = find_packet(stream_, std::max(sound_end_, search_from_) + 1, size_);
  if (!found || std::fseek(stream_, static_cast<long>(*found), SEEK_SET) != 0) {
    std::fseek(stream_, 0, SEEK_END);
    return false;
  }
  if (places_.count++ == 0) places_.first = sound_end_;
  places_.bytes += *found - sound_end_;
  search_from_ = *found;
  return true;
}

// The next packet starts where a packet of prism ends; anything else is damage.
bool CaptureReader::is_sound(std::span<const std::uint8_t> packet, std::uint32_t length, std::int64_t time_ns) {
  if (!nanoseconds_ || packet.size() != length || !is_own_record(packet, time_ns)) return !own_;
  own_ = true;
  sound_end_ = position_bytes();
  return true;
}

std::optional<CapturePacket> CaptureReader::next_pcap() {
  while (true) {
    pcap_pkthdr* header = nullptr;
    const u_char* data = nullptr;
    const int result = pcap_next_ex(pcap_.get(), &header, &data);
    if (result != 1) {
      if (result != PCAP_ERROR) return std::nullopt;
      damage_ = fmt::format("{}: {} (before byte {})", path_, pcap_geterr(pcap_.get()), position_bytes());
      if (!own_ || !resume()) return std::nullopt;
      damage_.clear();
      continue;
    }
    const std::span<const std::uint8_t> packet(data, header->caplen);
    const std::int64_t time_ns = std::int64_t{header->ts.tv_sec} * 1'000'000'000 + header->ts.tv_usec;
    if (!is_sound(packet, header->len, time_ns)) {
      if (resume()) continue;
      damage_ = fmt::format("{}: no packet at or after byte {}", path_, sound_end_);
      return std::nullopt;
    }
    const std::optional<CaptureEvent> event = decode_capture_event(packet);
    if (!event) {
      ++foreign_;
      continue;
    }
    return CapturePacket{time_ns, *event, packet.subspan(kCaptureRecordBytes)};
  }
}

Result<CaptureReader> CaptureReader::open(const std::string& path, std::optional<double> bytes_per_s) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return make_error(path, "is a directory, expected a capture (a .pcap file, or raw bytes)");
  CaptureReader file(path, bytes_per_s);
  if (auto opened = file.open_stream(); !opened) return tl::unexpected<Error>(opened.error());
  std::array<std::uint8_t, kPcapHeaderBytes> first{};
  const std::size_t got = std::fread(first.data(), 1, first.size(), file.stream_);
  std::rewind(file.stream_);
  Result<void> ready;
  if (is_pcap_magic({first.data(), got})) {
    file.bytes_per_s_.reset();
    file.nanoseconds_ = first[0] == 0x4D;
    ready = file.open_pcap(got);
  } else if (file.bytes_per_s_) {
    ready = file.open_bare();
  } else {
    ready = make_error(path, fmt::format("not a pcap file ({} bytes), expected a capture of link type {}", file.size_,
                                         kCaptureLinkType));
  }
  if (!ready) return tl::unexpected<Error>(ready.error());
  return file;
}

std::optional<CapturePacket> CaptureReader::next() {
  if (ended_) return std::nullopt;
  std::optional<CapturePacket> packet = bytes_per_s_ ? next_bare() : next_pcap();
  ended_ = !packet;
  return packet;
}

std::string DamagedRanges::text() const {
  if (count == 0) return "";
  return fmt::format("{} in {} from byte {} on are not packets", counted(bytes, "byte"), counted(count, "place"),
                     first);
}

Result<CaptureWriter> CaptureWriter::open(const std::string& path) {
  auto file = open_output(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return adopt(file->release(), path, nullptr);
}

Result<CaptureWriter> CaptureWriter::adopt(int descriptor, const std::string& path, Again again) {
  CaptureWriter writer(path, std::move(again), descriptor);
  const FileHeader header;
  writer.put({reinterpret_cast<const std::uint8_t*>(&header), sizeof header}, {});
  if (auto written = writer.flush(); !written) return tl::unexpected<Error>(written.error());
  return writer;
}

Result<void> CaptureWriter::state() const {
  if (!failure_.empty()) return make_error(path_, failure_);
  return {};
}

void CaptureWriter::fail(int error) { failure_ = fmt::format("cannot be written: {}", std::strerror(error)); }

void CaptureWriter::put(std::span<const std::uint8_t> header, std::span<const std::uint8_t> bytes) {
  const std::size_t before = buffer_.size(), count = header.size() + bytes.size();
  buffer_.resize(before + count);
  std::copy(bytes.begin(), bytes.end(), std::copy(header.begin(), header.end(), buffer_.data() + before));
  size_ += count;
}

void CaptureWriter::drain() {
  for (std::size_t done = 0; failure_.empty() && done < buffer_.size();) {
    const ssize_t written = ::write(file_.get(), buffer_.data() + done, buffer_.size() - done);
    if (written >= 0) {
      done += static_cast<std::size_t>(written);
    } else if (const int error = errno; error != EINTR && !(again_ && again_(error))) {
      fail(error);
    }
  }
  buffer_.clear();
}

Result<void> CaptureWriter::append(std::int64_t time_ns, CaptureEvent event, std::span<const std::uint8_t> bytes) {
  const auto record = encode_capture_record(time_ns, event);
  do {
    const auto packet = bytes.first(std::min(bytes.size(), kMostBytes));
    const auto count = static_cast<std::uint32_t>(record.size() + packet.size());
    const PacketHeader header{static_cast<std::uint32_t>(time_ns / 1'000'000'000),
                              static_cast<std::uint32_t>(time_ns % 1'000'000'000), count, count};
    std::array<std::uint8_t, sizeof header + kCaptureRecordBytes> head;
    std::memcpy(head.data(), &header, sizeof header);
    std::copy(record.begin(), record.end(), head.begin() + sizeof header);
    put(head, packet);
    if (buffer_.size() >= kWriteBytes) drain();
    bytes = bytes.subspan(packet.size());
  } while (!bytes.empty() && failure_.empty());
  return state();
}

Result<void> CaptureWriter::flush(bool sync) {
  drain();
  if (sync && failure_.empty() && ::fdatasync(file_.get()) != 0) fail(errno);
  return state();
}

}  // namespace prism::drivers
