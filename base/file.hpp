// SPDX-License-Identifier: MIT
// Opens regular files only, with bounded memory; never waits for a pipe or a device.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace prism {

/// Maximum size of a file that is read at once, by type.
inline constexpr std::uint64_t kMaxTextBytes = 4u << 20;     ///< configuration, frame description, list, state
inline constexpr std::uint64_t kMaxModelBytes = 256u << 20;  ///< model
inline constexpr std::size_t kMaxLineBytes = 1u << 20;       ///< one line of any file that is read by lines

/// Identifies a file by device and inode, independent of its name.
struct FileId {
  std::uint64_t device, inode;

  /// Of the name itself: does not follow a symbolic link. Returns nullopt if the file does not exist.
  static std::optional<FileId> of(const std::string& path);
  bool operator==(const FileId&) const = default;
};

/// An open file descriptor; closed with the object.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) reset(other.release());
    return *this;
  }
  int get() const { return fd_; }
  int release() noexcept { return std::exchange(fd_, -1); }
  void reset(int fd = -1) noexcept;

 private:
  int fd_;
};

/// Opens a regular file to read. Errors: missing, no permission, a directory, a pipe, a socket or a device.
Result<Descriptor> open_input(const std::string& path);

/// The same as a C stream (libpcap).
struct CloseStream {
  void operator()(std::FILE* stream) const { std::fclose(stream); }
};
using Stream = std::unique_ptr<std::FILE, CloseStream>;
Result<Stream> open_input_stream(const std::string& path);

/// Opens a regular file to write from its start. A new file has mode 0666 & ~umask; an existing one is emptied and
/// keeps its mode. Errors: as open_input(), and a symbolic link.
Result<Descriptor> open_output(const std::string& path);

Result<Stream> open_output_stream(const std::string& path);

/// All bytes of a regular file. Errors: as open_input(), a read error, more than `max_bytes`.
Result<std::string> read_text_file(const std::string& path, std::uint64_t max_bytes = kMaxTextBytes);

/// The same for a file that open_input() opened; `path` is for errors.
Result<std::string> read_text(const Descriptor& file, const std::string& path, std::uint64_t max_bytes = kMaxTextBytes);

/// Writes a temporary file next to the target, syncs it, then renames it: after a crash or on a full disk the old file
/// is intact. An existing file keeps its mode; a new one has `new_mode`, by default 0666 & ~umask. Errors: a symbolic
/// link, not a regular file, or the system's error.
Result<void> write_text_file(const std::string& path, std::string_view text,
                             std::optional<mode_t> new_mode = std::nullopt);

/// True if another open file description holds a lock (flock) on the file, as prismd does on a segment that it writes.
/// False also if the file cannot be opened.
bool is_locked(const std::string& path);

/// Makes renamed, new and deleted entries durable. Not an error if the file system cannot sync a directory.
void sync_directory(const std::string& path);

/// Writes all bytes to a blocking descriptor. Returns false with the cause in errno.
bool write_all(int descriptor, std::string_view bytes);

/// Reads a regular file by lines or bytes.
class FileReader {
 public:
  static Result<FileReader> open(const std::string& path);

  /// The next line without its '\n'; returns false at the end or on an error. The last line needs no '\n'. Errors: a
  /// read error, a line longer than kMaxLineBytes.
  bool read_line(std::string& line);
  /// True if the line that read_line() returned last ended with '\n'.
  bool line_ended() const { return line_ended_; }
  /// Up to bytes.size() bytes; fewer only at the end of the file or on an error.
  std::size_t read(std::span<char> bytes);
  /// Continues at `offset` bytes from the start.
  void seek(std::uint64_t offset);
  /// Offset of the next byte that will be returned.
  std::uint64_t offset() const { return buffer_offset_ + at_; }
  /// The first error, if any. Lines and bytes returned before it are valid.
  const std::optional<Error>& error() const { return error_; }
  /// error() as a Result.
  Result<void> finish() const;

 private:
  FileReader(Descriptor file, std::string path) : file_(std::move(file)), path_(std::move(path)) {}
  bool fill();

  Descriptor file_;
  std::string path_;
  std::vector<char> buffer_ = {};
  std::size_t at_ = 0;
  std::uint64_t buffer_offset_ = 0;  ///< of the first byte of buffer_ in the file
  bool line_ended_ = false;
  std::optional<Error> error_ = {};
};

}  // namespace prism
