// SPDX-License-Identifier: MIT
// Capture files: all bytes of the line with arrival times. pcap, link type 250, nanoseconds (docs/formats.md).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "drivers/capture_record.hpp"

namespace prism::drivers {

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

  CaptureWriter(CaptureWriter&&) noexcept;
  CaptureWriter& operator=(CaptureWriter&&) noexcept;
  ~CaptureWriter();

  /// Adds bytes that had arrived at `time_ns` (0 to 2^32 s). Buffered until flush().
  Result<void> data(std::int64_t time_ns, std::span<const std::uint8_t> bytes);
  /// Adds bytes that were sent to the device at `time_ns`; a replay ignores them.
  Result<void> sent(std::int64_t time_ns, std::span<const std::uint8_t> bytes);
  /// Records that the line was opened at `time_ns`: replay starts a new session here.
  Result<void> opened(std::int64_t time_ns);
  /// Writes the buffer; with `sync`, waits until it is on the disk.
  Result<void> flush(bool sync = false);

  int descriptor() const;
  const std::string& path() const;
  std::uint64_t bytes_written() const;  ///< size of the file after the next flush

 private:
  struct File;
  explicit CaptureWriter(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

/// Settings to replay a raw byte stream (not pcap), as `cat /dev/ttyUSB0 > file` writes it.
struct RawByteStream {
  double bytes_per_second = 0;  ///< > 0: frame length times nominal frame rate
  std::int64_t start_ns = 0;    ///< the time of the first byte
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
  /// Opens a pcap or pcapng file of link type 250; with `bare`, any other file as raw bytes at that rate, in chunks of
  /// at most 1024 bytes or 10 ms. Errors: missing, another link type, not pcap and no `bare`, a text that shows bytes
  /// (shown_bytes.hpp).
  static Result<CaptureReader> open(const std::string& path, std::optional<RawByteStream> bare = std::nullopt);

  CaptureReader(CaptureReader&&) noexcept;
  CaptureReader& operator=(CaptureReader&&) noexcept;
  ~CaptureReader();

  /// The next packet; nullopt at the end. Counts and skips packets that are not from a serial line.
  std::optional<CapturePacket> next();

  /// After the end: position and type of a truncation or damage in one line; empty if the file is intact.
  const std::string& tail_damage() const;
  const DamagedRanges& damaged_places() const;  ///< skipped so far
  std::uint64_t foreign_packets() const;        ///< too short for a record
  bool is_bare() const;
  std::uint64_t position_bytes() const;  ///< read so far, for a progress bar
  std::uint64_t size_bytes() const;

 private:
  struct File;
  explicit CaptureReader(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

}  // namespace prism::drivers
