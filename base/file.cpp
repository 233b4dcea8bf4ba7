// SPDX-License-Identifier: MIT
#include "base/file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace prism {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferBytes = 64 << 10;

tl::unexpected<Error> system_error(const std::string& path, const char* what) {
  return make_error(path, fmt::format("{}: {}", what, std::strerror(errno)));
}

const char* file_type(mode_t mode) {
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  if (S_ISLNK(mode)) return "a symbolic link";
  return "a device";
}

tl::unexpected<Error> wrong_type(const std::string& path, mode_t mode) {
  return make_error(path, fmt::format("is {}, expected a regular file", file_type(mode)));
}

/// read(2), repeated if interrupted; −1 with the cause in errno.
ssize_t read_some(int file, char* at, std::size_t size) {
  ssize_t got;
  do got = ::read(file, at, size);
  while (got < 0 && errno == EINTR);
  return got;
}

Result<Stream> stream_of(Result<Descriptor> file, const std::string& path, const char* mode) {
  if (!file) return tl::unexpected(file.error());
  Stream stream(::fdopen(file->get(), mode));
  if (!stream) return system_error(path, "cannot be opened");
  (void)file->release();
  return stream;
}

/// Opens, writes and closes. Returns false with the cause in errno.
bool write_new(const std::string& path, std::string_view text, std::optional<mode_t> mode) {
  const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) return false;
  const bool written = write_all(file, text) && (!mode || ::fchmod(file, *mode) == 0) && ::fsync(file) == 0;
  const int error = errno;
  const bool closed = ::close(file) == 0;
  if (!written) errno = error;
  return written && closed;
}

}  // namespace

bool is_locked(const std::string& path) {
  // without O_NONBLOCK, open() of a FIFO would wait for a writer
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  return file.get() >= 0 && ::flock(file.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

void sync_directory(const std::string& path) {
  const Descriptor opened(::open(path.empty() ? "." : path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() >= 0) ::fsync(opened.get());
}

std::optional<FileId> FileId::of(const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return std::nullopt;
  return FileId{found.st_dev, found.st_ino};
}

void Descriptor::reset(int fd) noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = fd;
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

Result<Descriptor> open_input(const std::string& path) {
  // Checks the type first: opening a device may have an effect (tape, modem lines) and opening a pipe may wait.
  struct stat found {};
  if (path.find('\0') != path.npos) return make_error(path, "contains a NUL byte, expected the path of a file");
  if (::stat(path.c_str(), &found) != 0) return system_error(path, "cannot be read");
  if (!S_ISREG(found.st_mode)) return wrong_type(path, found.st_mode);
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (file.get() < 0 || ::fstat(file.get(), &found) != 0) return system_error(path, "cannot be read");
  if (!S_ISREG(found.st_mode)) return wrong_type(path, found.st_mode);  // replaced since stat()
  return file;
}

Result<Stream> open_input_stream(const std::string& path) { return stream_of(open_input(path), path, "rb"); }

Result<Descriptor> open_output(const std::string& path) {
  struct stat found {};
  if (path.find('\0') != path.npos) return make_error(path, "contains a NUL byte, expected the path of a file");
  if (::lstat(path.c_str(), &found) == 0 && !S_ISREG(found.st_mode)) return wrong_type(path, found.st_mode);
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666));
  if (file.get() < 0 || ::fstat(file.get(), &found) != 0) return system_error(path, "cannot be written");
  if (!S_ISREG(found.st_mode)) return wrong_type(path, found.st_mode);
  if (::ftruncate(file.get(), 0) != 0) return system_error(path, "cannot be written");
  return file;
}

Result<Stream> open_output_stream(const std::string& path) { return stream_of(open_output(path), path, "wb"); }

Result<std::string> read_text_file(const std::string& path, std::uint64_t max_bytes) {
  return open_input(path).and_then([&](const Descriptor& file) { return read_text(file, path, max_bytes); });
}

Result<std::string> read_text(const Descriptor& file, const std::string& path, std::uint64_t max_bytes) {
  const auto too_large = [&] {
    return make_error(path, fmt::format("is larger than {} MiB, the limit for such a file", max_bytes >> 20));
  };
  struct stat found {};
  if (::fstat(file.get(), &found) == 0 && static_cast<std::uint64_t>(found.st_size) > max_bytes) return too_large();
  std::string text(static_cast<std::size_t>(found.st_size) + 1, '\0');  // one more byte to detect the end
  std::size_t size = 0;
  for (;;) {
    const ssize_t got = read_some(file.get(), text.data() + size, text.size() - size);
    if (got < 0) return system_error(path, "cannot be read");
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
    if (size > max_bytes) return too_large();
    if (size == text.size()) text.resize(text.size() + kBufferBytes);  // it grew while being read, or is in /proc
  }
  text.resize(size);
  return text;
}

Result<void> write_text_file(const std::string& path, std::string_view text, std::optional<mode_t> new_mode) {
  struct stat old {};
  if (path.find('\0') != path.npos) return make_error(path, "contains a NUL byte, expected the path of a file");
  const bool exists = ::lstat(path.c_str(), &old) == 0;
  if (exists && !S_ISREG(old.st_mode)) return wrong_type(path, old.st_mode);
  const std::string temporary = fmt::format("{}.{}.new", path, ::getpid());
  ::unlink(temporary.c_str());  // left by a process that died
  if (exists) new_mode = old.st_mode & 07777;
  const bool done = write_new(temporary, text, new_mode) && std::rename(temporary.c_str(), path.c_str()) == 0;
  if (done) return sync_directory(fs::path(path).parent_path().string()), Result<void>();
  const auto failed = system_error(path, "cannot be written");
  ::unlink(temporary.c_str());
  return failed;
}

Result<FileReader> FileReader::open(const std::string& path) {
  return open_input(path).map([&](Descriptor file) { return FileReader(std::move(file), path); });
}

/// Replaces the used buffer by the next bytes of the file.
bool FileReader::fill() {
  if (error_) return false;
  buffer_offset_ += buffer_.size();
  at_ = 0;
  buffer_.resize(kBufferBytes);
  const ssize_t got = read_some(file_.get(), buffer_.data(), buffer_.size());
  if (got < 0) error_ = system_error(path_, "cannot be read").value();
  buffer_.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return !buffer_.empty();
}

bool FileReader::read_line(std::string& line) {
  line.clear();
  line_ended_ = false;
  while (at_ < buffer_.size() || fill()) {
    const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(at_);
    const auto end = std::find(begin, buffer_.end(), '\n');
    line.append(begin, end);
    at_ = static_cast<std::size_t>(end - buffer_.begin());
    if (line.size() > kMaxLineBytes) {
      if (!error_) error_ = Error{path_, fmt::format("has a line longer than {} bytes", kMaxLineBytes)};
      at_ = buffer_.size();
      return false;
    }
    if (end != buffer_.end()) return ++at_, line_ended_ = true;
  }
  return !line.empty() && !error_;
}

std::size_t FileReader::read(std::span<char> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    if (at_ == buffer_.size() && !fill()) break;
    const std::size_t part = std::min(bytes.size() - done, buffer_.size() - at_);
    std::memcpy(bytes.data() + done, buffer_.data() + at_, part);
    at_ += part;
    done += part;
  }
  return done;
}

void FileReader::seek(std::uint64_t offset) {
  if (offset >= buffer_offset_ && offset <= buffer_offset_ + buffer_.size()) {
    at_ = static_cast<std::size_t>(offset - buffer_offset_);
    return;
  }
  if (::lseek(file_.get(), static_cast<off_t>(offset), SEEK_SET) < 0 && !error_)
    error_ = system_error(path_, "cannot be read").value();
  buffer_.clear();
  at_ = 0;
  buffer_offset_ = offset;
}

Result<void> FileReader::finish() const {
  if (error_) return tl::unexpected<Error>(*error_);
  return {};
}

}  // namespace prism
