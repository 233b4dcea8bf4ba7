// SPDX-License-Identifier: MIT
#include "tools/prismweb/secret_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "base/file.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kMaxPrivateBytes = 64 << 10;

bool is_private(int fd) {
  struct stat found {};
  return ::fstat(fd, &found) == 0 && S_ISREG(found.st_mode) && found.st_uid == ::geteuid() &&
         (found.st_mode & 07777) == 0600 && found.st_nlink == 1;
}

}  // namespace

std::optional<std::string> read_private_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY));
  if (file.get() < 0 || !is_private(file.get())) return std::nullopt;
  std::string text(kMaxPrivateBytes, '\0');
  const ssize_t size = ::read(file.get(), text.data(), text.size());
  if (size < 0) return std::nullopt;
  text.resize(static_cast<std::size_t>(size));
  return text;
}

Result<void> write_private_file(const std::string& path, std::string_view text) {
  const std::string temporary = fmt::format("{}.{}.new", path, ::getpid());
  ::unlink(temporary.c_str());  // left by a process that crashed
  const auto failed = [&] {
    const int error = errno;
    ::unlink(temporary.c_str());
    return make_error(path, fmt::format("cannot be written: {}", std::strerror(error)));
  };
  const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (file.get() < 0 || ::fchmod(file.get(), 0600) != 0 || !write_all(file.get(), text)) return failed();
  if (std::rename(temporary.c_str(), path.c_str()) != 0) return failed();
  return {};
}

}  // namespace prism::prismweb
