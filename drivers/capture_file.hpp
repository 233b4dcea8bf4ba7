// SPDX-License-Identifier: MIT
// Capture files: all bytes of the line with arrival times. pcap, link type 250, nanoseconds (docs/formats.md).
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/result.hpp"

struct pcap;  // pcap_t of libpcap

namespace prism::drivers {

enum class CaptureEvent {
  kOpened,  ///< the line was (re)opened: decoder and clock restart. In the file: status change, 0
  kData,    ///< bytes from the line. In the file: data received, 2
  kSent,    ///< bytes that prismd sent to the device. In the file: data sent, 1
  kOther,   ///< other records of a serial analyser: line errors
};

/// A packet of a capture.
struct CapturePacket {
  std::int64_t time_ns = 0;  ///< nanoseconds since 1970 UTC, or since the device clock's epoch
  CaptureEvent event = CaptureEvent::kData;
  std::span<const std::uint8_t> bytes;  ///< valid until the next call of next()
};

/// Appends packets and never rewrites bytes, so a torn write can damage only the last packet. After an error (disk
/// full, I/O error) every later call returns the same error.
class CaptureWriter {
 public:
  /// Creates or replaces the file. Errors: it cannot be created or written.
  static Result<CaptureWriter> open(const std::string& path);
  /// Called with errno if a write fails; returns true to retry after it has freed space.
  using Again = std::function<bool(int error)>;
  /// The same on a new file that the caller opened for writing; `path` is its name in errors. Takes ownership of the
  /// descriptor, also on error. `again` may be null.
  static Result<CaptureWriter> adopt(int descriptor, const std::string& path, Again again);

  CaptureWriter(CaptureWriter&&) = default;
  CaptureWriter& operator=(CaptureWriter&&) = delete;
  ~CaptureWriter() { drain(); }

  /// Adds an event of the line at `time_ns` (0 to 2^32 s), and its bytes. Buffered until flush().
  Result<void> append(std::int64_t time_ns, CaptureEvent event, std::span<const std::uint8_t> bytes);
  /// Adds bytes that had arrived at `time_ns`.
  Result<void> data(std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
    return append(time_ns, CaptureEvent::kData, bytes);
  }
  /// Records that the line was opened at `time_ns`: replay starts a new session here.
  Result<void> opened(std::int64_t time_ns) { return append(time_ns, CaptureEvent::kOpened, {}); }
  /// Writes the buffer; with `sync`, waits until it is on the disk.
  Result<void> flush(bool sync = false);

  int descriptor() const { return file_.get(); }
  const std::string& path() const { return path_; }
  std::uint64_t bytes_written() const { return size_; }  ///< size of the file after the next flush

 private:
  CaptureWriter(std::string path, Again again, int descriptor)
      : path_(std::move(path)), again_(std::move(again)), file_(descriptor) {}
  Result<void> state() const;
  void fail(int error);
  void put(std::span<const std::uint8_t> header, std::span<const std::uint8_t> bytes);
  void drain();

  std::string path_, failure_;
  Again again_;
  Descriptor file_;
  std::vector<std::uint8_t> buffer_;
  std::uint64_t size_ = 0;
};

/// Bytes between packets that do not belong to a packet.
struct DamagedRanges {
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;  ///< total
  std::uint64_t first = 0;  ///< offset in the file

  /// "64 bytes in 1 place from byte 128 on are not packets"; empty without damage.
  std::string text() const;
};

/// Reads captures by packets. Continues after damage at the next valid packet if prism wrote the file.
class CaptureReader {
 public:
  /// Opens a pcap or pcapng file of link type 250; with `bytes_per_s` (> 0), any other file as raw bytes at that rate,
  /// as `cat /dev/ttyUSB0 > file` writes it, in chunks of at most 1024 bytes or 10 ms. Errors: missing, another link
  /// type, not pcap and no rate, a text that shows bytes (shown_bytes.hpp).
  static Result<CaptureReader> open(const std::string& path, std::optional<double> bytes_per_s = std::nullopt);

  CaptureReader(CaptureReader&&) = default;
  CaptureReader& operator=(CaptureReader&&) = delete;

  /// The next packet; nullopt at the end. Counts and skips packets that are not from a serial line.
  std::optional<CapturePacket> next();

  /// After the end: position and type of a truncation or damage in one line; empty if the file is intact.
  const std::string& tail_damage() const { return damage_; }
  const DamagedRanges& damaged_places() const { return places_; }  ///< skipped so far
  std::uint64_t foreign_packets() const { return foreign_; }       ///< too short for a record
  bool is_bare() const { return bytes_per_s_.has_value(); }
  std::uint64_t position_bytes() const;  ///< read so far, for a progress bar
  std::uint64_t size_bytes() const { return size_; }

 private:
  struct ClosePcap {
    void operator()(pcap* file) const;
  };

  CaptureReader(std::string path, std::optional<double> bytes_per_s);
  Result<void> open_stream();
  Result<void> open_pcap(std::size_t first_bytes);
  Result<void> open_bare();
  std::optional<CapturePacket> next_bare();
  std::optional<CapturePacket> next_pcap();
  bool resume();
  bool is_sound(std::span<const std::uint8_t> packet, std::uint32_t length, std::int64_t time_ns);

  std::string path_, damage_;
  std::vector<char> buffer_;  ///< of the stream
  Stream own_stream_;         ///< until pcap owns it
  std::unique_ptr<pcap, ClosePcap> pcap_;
  std::FILE* stream_ = nullptr;
  std::uint64_t size_ = 0, foreign_ = 0;
  std::optional<double> bytes_per_s_;  ///< of raw bytes
  std::uint64_t bare_position_ = 0;
  std::vector<std::uint8_t> bytes_;  ///< of a raw stream: a chunk
  bool ended_ = false;
  bool nanoseconds_ = false;     ///< the magic that prism writes
  bool own_ = false;             ///< a packet written by prism was read: anything else is damage
  std::uint64_t sound_end_ = 0;  ///< of the last packet written by prism
  std::uint64_t search_from_ = 0;
  DamagedRanges places_;
};

}  // namespace prism::drivers
