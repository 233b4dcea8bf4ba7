// SPDX-License-Identifier: MIT
// Capture files: every byte of the line with its arrival time. pcap, link type 250, nanoseconds (docs/formats.md).
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

/// What stands in a capture between two packet headers.
struct CapturePacket {
  std::int64_t time_ns = 0;  ///< nanoseconds since 1970 UTC, or since the device clock's epoch
  CaptureEvent event = CaptureEvent::kData;
  std::span<const std::uint8_t> bytes;  ///< valid until the next call of next()
};

/// Writes packets one behind the other; nothing written is touched again, so a torn write costs the last packet only.
/// After a refusal (disk full, I/O error) every later call is refused with the same words.
class CaptureWriter {
 public:
  /// Creates the file; one that is there is replaced. Refused where the file cannot be created or written.
  static Result<CaptureWriter> open(const std::string& path);
  /// Asked with errno where a write fails: true to try again, as room was made.
  using Again = std::function<bool(int error)>;
  /// The same over a new file that the caller opened for writing; `path` is its name in refusals. The descriptor is the
  /// writer's from here on, refused or not. `again` may be null.
  static Result<CaptureWriter> adopt(int descriptor, const std::string& path, Again again);

  CaptureWriter(CaptureWriter&&) noexcept;
  CaptureWriter& operator=(CaptureWriter&&) noexcept;
  ~CaptureWriter();

  /// Bytes that had arrived at `time_ns` (0 to 2^32 s). Buffered: what stands on disk is known after flush() only.
  Result<void> data(std::int64_t time_ns, std::span<const std::uint8_t> bytes);
  /// The line was opened at `time_ns`: replay begins a new session here.
  Result<void> opened(std::int64_t time_ns);
  /// Hands the buffer to the system; with `sync`, waits until it stands on disk.
  Result<void> flush(bool sync = false);

  int descriptor() const;
  const std::string& path() const;
  std::uint64_t bytes_written() const;  ///< size of the file once it is flushed

 private:
  struct File;
  explicit CaptureWriter(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

/// How to replay a file that is no pcap file: bytes only, as `cat /dev/ttyUSB0 > file` leaves them.
struct BareBytes {
  double bytes_per_second = 0;  ///< > 0: frame length times nominal frame rate
  std::int64_t start_ns = 0;    ///< the time of the first byte
};

/// Bytes between two packets that are none.
struct DamagedPlaces {
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;  ///< in all of them
  std::uint64_t first = 0;  ///< offset in the file

  /// "64 bytes in 1 place from byte 128 on are no packet"; empty where there are none.
  std::string text() const;
};

/// Reads captures packet by packet; nothing in a file, whole or damaged, stops it but the end of what can be read. In a
/// pcap file that prism wrote it goes on behind damage at the next packet that is sound.
class CaptureReader {
 public:
  /// Opens a pcap or pcapng file of link type 250; with `bare`, a file of any other kind as bare bytes at that rate, in
  /// chunks of at most 1024 bytes or 10 ms. Refused in one line: not there, another link type, no pcap file and no
  /// `bare`.
  static Result<CaptureReader> open(const std::string& path, std::optional<BareBytes> bare = std::nullopt);

  CaptureReader(CaptureReader&&) noexcept;
  CaptureReader& operator=(CaptureReader&&) noexcept;
  ~CaptureReader();

  /// The next packet; nothing at the end. Packets that no serial line wrote are counted and left out.
  std::optional<CapturePacket> next();

  /// After the end: where and how the file was cut or damaged, in one line; empty where it ended as it should.
  const std::string& tail_damage() const;
  const DamagedPlaces& damaged_places() const;  ///< that were passed over so far
  std::uint64_t foreign_packets() const;        ///< too short to hold a record
  bool is_bare() const;
  std::uint64_t position_bytes() const;  ///< read so far: for a progress bar
  std::uint64_t size_bytes() const;

 private:
  struct File;
  explicit CaptureReader(std::unique_ptr<File> file);
  std::unique_ptr<File> file_;
};

}  // namespace prism::drivers
