// SPDX-License-Identifier: MIT
#include "base/text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace prism {
namespace {

namespace fs = std::filesystem;

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Opens, writes and closes; false with the cause in errno.
bool write_to(const std::string& path, int flags, mode_t mode, std::string_view text, bool lasting) {
  const int file = ::open(path.c_str(), flags | O_WRONLY | O_CLOEXEC, mode);
  if (file < 0) return false;
  const bool written = write_all(file, text) && (!lasting || ::fsync(file) == 0);
  const int error = errno;
  const bool closed = ::close(file) == 0;
  if (!written) errno = error;
  return written && closed;
}

/// The new name is on the disk only when its folder is. A file system that cannot promise it is no refusal.
void sync_folder(const fs::path& folder) {
  const int opened = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return;
  ::fsync(opened);
  ::close(opened);
}

}  // namespace

Result<std::string> read_text_file(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return refuse(path, "is a folder, expected a file");
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return refuse(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string text(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) return refuse(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  return text;
}

Result<void> write_text_file(const std::string& path, std::string_view text) {
  const auto refusal = [&] { return refuse(path, fmt::format("cannot be written: {}", std::strerror(errno))); };
  struct stat old {};
  const bool exists = ::stat(path.c_str(), &old) == 0;
  if (exists && S_ISDIR(old.st_mode)) return refuse(path, "is a folder, expected a file");
  if (exists && !S_ISREG(old.st_mode)) {
    return write_to(path, 0, 0, text, false) ? Result<void>() : refusal();
  }
  std::error_code error;
  const fs::path target = exists ? fs::canonical(path, error) : fs::path(path);
  if (error) return refuse(path, "cannot be written: " + error.message());
  const std::string temporary = fmt::format("{}.{}.new", target.string(), ::getpid());
  ::unlink(temporary.c_str());  // of a process that died; a link there would lead anywhere
  const bool done = write_to(temporary, O_CREAT | O_EXCL | O_NOFOLLOW, 0666, text, true) &&
                    (!exists || ::chmod(temporary.c_str(), old.st_mode & 07777) == 0) &&
                    std::rename(temporary.c_str(), target.c_str()) == 0;
  if (done) return sync_folder(target.parent_path()), Result<void>();
  const auto refused = refusal();
  ::unlink(temporary.c_str());
  return refused;
}

}  // namespace prism
