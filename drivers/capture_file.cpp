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
constexpr std::size_t kPcapHeaderBytes = 24;

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

}  // namespace

struct CaptureReader::File {
  std::string path, damage;
  std::vector<char> buffer;
  pcap_t* pcap = nullptr;  // owns the stream after it is opened
  std::FILE* stream = nullptr;
  std::uint64_t size = 0, foreign = 0;
  std::optional<RawByteStream> bare;
  std::uint64_t bare_position = 0;
  std::size_t bare_chunk = 0;
  std::array<std::uint8_t, kMostBareBytes> bytes{};
  bool ended = false;
  bool nanoseconds = false;     // the magic that prism writes
  bool own = false;             // a packet written by prism was read: anything else is damage
  std::uint64_t sound_end = 0;  // of the last packet written by prism
  std::uint64_t search_from = 0;
  DamagedRanges places;

  ~File() {
    if (pcap) {
      pcap_close(pcap);
    } else if (stream) {
      std::fclose(stream);
    }
  }

  std::uint64_t position() const {
    const long at = std::ftell(stream);
    return at < 0 ? 0 : static_cast<std::uint64_t>(at);
  }

  Result<void> open_stream() {
    auto opened = open_input_stream(path);
    if (!opened) return tl::unexpected<Error>(opened.error());
    stream = opened->release();
    struct stat status {};
    if (::fstat(fileno(stream), &status) != 0) return make_error(path, "cannot be read");
    size = static_cast<std::uint64_t>(status.st_size);
    buffer.resize(kReadBytes);
    std::setvbuf(stream, buffer.data(), _IOFBF, buffer.size());
    __fsetlocking(stream, FSETLOCKING_BYCALLER);  // one thread reads
    return {};
  }

  Result<void> open_pcap(std::size_t first_bytes) {
    if (first_bytes < kPcapHeaderBytes) {  // capture truncated at its start: it is empty
      damage = fmt::format("{}: truncated in the file header, at byte {}", path, first_bytes);
      ended = true;
      return {};
    }
    char why[PCAP_ERRBUF_SIZE] = "";
    pcap = pcap_fopen_offline_with_tstamp_precision(stream, PCAP_TSTAMP_PRECISION_NANO, why);
    if (!pcap) return make_error(path, fmt::format("found a damaged pcap file ({}), expected a capture", why));
    const int link = pcap_datalink(pcap);
    if (link == kCaptureLinkType) return {};
    const char* name = pcap_datalink_val_to_name(link);
    return make_error(
        path, fmt::format("found a capture of link type {} ({}), expected {} (serial line); to extract bytes of TCP: "
                          "tshark -r FILE -Y tcp.payload -T fields -e tcp.payload | xxd -r -p >BYTES",
                          link, name ? name : "unknown", kCaptureLinkType));
  }

  Result<void> open_bare(const RawByteStream& rate) {
    if (!(rate.bytes_per_second > 0) || !std::isfinite(rate.bytes_per_second)) {
      return make_error(path, "found no rate for raw bytes, expected more than 0 bytes/s");
    }
    bare = rate;
    const double most = std::clamp(rate.bytes_per_second * kMostBareSeconds, 1.0, static_cast<double>(kMostBareBytes));
    bare_chunk = static_cast<std::size_t>(most);
    std::array<char, kFirstBytes> first;
    const std::size_t got = std::fread(first.data(), 1, first.size(), stream);
    std::rewind(stream);
    const auto checked = has_sentences(path, {first.data(), got});
    return checked ? Result<void>() : tl::unexpected<Error>(checked.error());
  }

  std::optional<CapturePacket> next_bare() {
    const std::size_t got = std::fread(bytes.data(), 1, bare_chunk, stream);
    if (got == 0) {
      if (std::ferror(stream)) damage = fmt::format("{}: {} at byte {}", path, std::strerror(errno), bare_position);
      return std::nullopt;
    }
    bare_position += got;
    const double seconds = static_cast<double>(bare_position) / bare->bytes_per_second;
    return CapturePacket{bare->start_ns + std::llround(seconds * 1e9), CaptureEvent::kData, {bytes.data(), got}};
  }

  /// Continues at the next packet written by prism, or returns false.
  bool resume() {
    const auto found = find_packet(stream, std::max(sound_end, search_from) + 1, size);
    if (!found || std::fseek(stream, static_cast<long>(*found), SEEK_SET) != 0) {
      std::fseek(stream, 0, SEEK_END);
      return false;
    }
    if (places.count++ == 0) places.first = sound_end;
    places.bytes += *found - sound_end;
    search_from = *found;
    return true;
  }

  // The next packet starts where a packet of prism ends; anything else is damage.
  bool is_sound(std::span<const std::uint8_t> packet, std::uint32_t length, std::int64_t time_ns) {
    if (!nanoseconds || packet.size() != length || !is_own_record(packet, time_ns)) return !own;
    own = true;
    sound_end = position();
    return true;
  }

  std::optional<CapturePacket> next_pcap() {
    while (true) {
      pcap_pkthdr* header = nullptr;
      const u_char* data = nullptr;
      const int result = pcap_next_ex(pcap, &header, &data);
      if (result != 1) {
        if (result != PCAP_ERROR) return std::nullopt;
        damage = fmt::format("{}: {} (before byte {})", path, pcap_geterr(pcap), position());
        if (!own || !resume()) return std::nullopt;
        damage.clear();
        continue;
      }
      const std::span<const std::uint8_t> packet(data, header->caplen);
      const std::int64_t time_ns = std::int64_t{header->ts.tv_sec} * 1'000'000'000 + header->ts.tv_usec;
      if (!is_sound(packet, header->len, time_ns)) {
        if (resume()) continue;
        damage = fmt::format("{}: no packet at or after byte {}", path, sound_end);
        return std::nullopt;
      }
      const std::optional<CaptureEvent> event = decode_capture_event(packet);
      if (!event) {
        ++foreign;
        continue;
      }
      return CapturePacket{time_ns, *event, packet.subspan(kCaptureRecordBytes)};
    }
  }
};

CaptureReader::CaptureReader(std::unique_ptr<File> file) : file_(std::move(file)) {}
CaptureReader::CaptureReader(CaptureReader&&) noexcept = default;
CaptureReader& CaptureReader::operator=(CaptureReader&&) noexcept = default;
CaptureReader::~CaptureReader() = default;

Result<CaptureReader> CaptureReader::open(const std::string& path, std::optional<RawByteStream> bare) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return make_error(path, "is a directory, expected a capture (a .pcap file, or raw bytes)");
  auto file = std::make_unique<File>();
  file->path = path;
  if (auto opened = file->open_stream(); !opened) return tl::unexpected<Error>(opened.error());
  std::array<std::uint8_t, kPcapHeaderBytes> first{};
  const std::size_t got = std::fread(first.data(), 1, first.size(), file->stream);
  std::rewind(file->stream);
  Result<void> ready;
  if (is_pcap_magic({first.data(), got})) {
    file->nanoseconds = first[0] == 0x4D;
    ready = file->open_pcap(got);
  } else if (bare) {
    ready = file->open_bare(*bare);
  } else {
    ready = make_error(path, fmt::format("not a pcap file ({} bytes), expected a capture of link type {}", file->size,
                                         kCaptureLinkType));
  }
  if (!ready) return tl::unexpected<Error>(ready.error());
  return CaptureReader(std::move(file));
}

std::optional<CapturePacket> CaptureReader::next() {
  if (file_->ended) return std::nullopt;
  std::optional<CapturePacket> packet = file_->bare ? file_->next_bare() : file_->next_pcap();
  file_->ended = !packet;
  return packet;
}

std::string DamagedRanges::text() const {
  if (count == 0) return "";
  return fmt::format("{} in {} from byte {} on are not packets", counted(bytes, "byte"), counted(count, "place"),
                     first);
}

const DamagedRanges& CaptureReader::damaged_places() const { return file_->places; }
const std::string& CaptureReader::tail_damage() const { return file_->damage; }
std::uint64_t CaptureReader::foreign_packets() const { return file_->foreign; }
bool CaptureReader::is_bare() const { return file_->bare.has_value(); }
std::uint64_t CaptureReader::position_bytes() const { return file_->position(); }
std::uint64_t CaptureReader::size_bytes() const { return file_->size; }

namespace {

constexpr std::size_t kMostBytes = 65536;  // of the line in one packet; longer chunks are split
constexpr std::size_t kWriteBytes = 1 << 18;

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

}  // namespace

struct CaptureWriter::File {
  std::string path, failure;
  Again again;
  int descriptor = -1;
  std::vector<std::uint8_t> buffer;
  std::uint64_t size = 0;

  ~File() {
    drain();
    ::close(descriptor);
  }

  Result<void> state() const {
    if (!failure.empty()) return make_error(path, failure);
    return {};
  }

  void fail(int error) { failure = fmt::format("cannot be written: {}", std::strerror(error)); }

  void put(std::span<const std::uint8_t> header, std::span<const std::uint8_t> bytes) {
    const std::size_t before = buffer.size(), count = header.size() + bytes.size();
    buffer.resize(before + count);
    std::copy(bytes.begin(), bytes.end(), std::copy(header.begin(), header.end(), buffer.data() + before));
    size += count;
  }

  void drain() {
    for (std::size_t done = 0; failure.empty() && done < buffer.size();) {
      const ssize_t written = ::write(descriptor, buffer.data() + done, buffer.size() - done);
      if (written >= 0) {
        done += static_cast<std::size_t>(written);
      } else if (const int error = errno; error != EINTR && !(again && again(error))) {
        fail(error);
      }
    }
    buffer.clear();
  }

  Result<void> append(std::int64_t time_ns, CaptureEvent event, std::span<const std::uint8_t> bytes) {
    const auto record = encode_capture_record(time_ns, event);
    const auto count = static_cast<std::uint32_t>(record.size() + bytes.size());
    const PacketHeader header{static_cast<std::uint32_t>(time_ns / 1'000'000'000),
                              static_cast<std::uint32_t>(time_ns % 1'000'000'000), count, count};
    std::array<std::uint8_t, sizeof header + kCaptureRecordBytes> head;
    std::memcpy(head.data(), &header, sizeof header);
    std::copy(record.begin(), record.end(), head.begin() + sizeof header);
    put(head, bytes);
    if (buffer.size() >= kWriteBytes) drain();
    return state();
  }
};

CaptureWriter::CaptureWriter(std::unique_ptr<File> file) : file_(std::move(file)) {}
CaptureWriter::CaptureWriter(CaptureWriter&&) noexcept = default;
CaptureWriter& CaptureWriter::operator=(CaptureWriter&&) noexcept = default;
CaptureWriter::~CaptureWriter() = default;

Result<CaptureWriter> CaptureWriter::open(const std::string& path) {
  auto file = open_output(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return adopt(file->release(), path, nullptr);
}

Result<CaptureWriter> CaptureWriter::adopt(int descriptor, const std::string& path, Again again) {
  auto file = std::make_unique<File>();
  file->path = path;
  file->again = std::move(again);
  file->descriptor = descriptor;
  const FileHeader header;
  file->put({reinterpret_cast<const std::uint8_t*>(&header), sizeof header}, {});
  CaptureWriter writer(std::move(file));
  if (auto written = writer.flush(); !written) return tl::unexpected<Error>(written.error());
  return writer;
}

Result<void> CaptureWriter::data(std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
  while (bytes.size() > kMostBytes) {
    if (auto done = file_->append(time_ns, CaptureEvent::kData, bytes.first(kMostBytes)); !done) return done;
    bytes = bytes.subspan(kMostBytes);
  }
  return file_->append(time_ns, CaptureEvent::kData, bytes);
}

Result<void> CaptureWriter::sent(std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
  return file_->append(time_ns, CaptureEvent::kSent, bytes);
}

Result<void> CaptureWriter::opened(std::int64_t time_ns) { return file_->append(time_ns, CaptureEvent::kOpened, {}); }

Result<void> CaptureWriter::flush(bool sync) {
  file_->drain();
  if (sync && file_->failure.empty() && ::fdatasync(file_->descriptor) != 0) file_->fail(errno);
  return file_->state();
}

int CaptureWriter::descriptor() const { return file_->descriptor; }

const std::string& CaptureWriter::path() const { return file_->path; }

std::uint64_t CaptureWriter::bytes_written() const { return file_->size; }

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
