// SPDX-License-Identifier: MIT
#include "tools/prismweb/token_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace prism::prismweb {
namespace {

std::string runtime_folder() {
  for (const char* name : {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != '\0') return value;
  }
  return "/tmp";
}

std::string path_of(int port) { return fmt::format("{}/prismweb-{}.token", runtime_folder(), port); }

constexpr std::size_t kLeastToken = 32;  // what make_token makes is longer

}  // namespace

std::string kept_token(int port) {
  const int fd = ::open(path_of(port).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) return "";
  struct stat facts {};
  char text[256];
  const bool ours = ::fstat(fd, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_uid == ::geteuid() &&
                    (facts.st_mode & 07777) == 0600 && facts.st_nlink == 1;
  const ssize_t size = ours ? ::read(fd, text, sizeof text) : 0;
  ::close(fd);
  if (size <= 1 || text[size - 1] != '\n') return "";
  const std::string token(text, static_cast<std::size_t>(size) - 1);
  const bool whole =
      token.size() >= kLeastToken && token.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  return whole ? token : "";
}

// In a folder that others may write a file of this name may be theirs: it is made anew, never written into.
Result<std::string> write_token(const std::string& token, int port) {
  std::string path = path_of(port);
  ::unlink(path.c_str());
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return refuse(path, fmt::format("cannot make it for the token: {}", std::strerror(errno)));
  const std::string line = token + "\n";
  const bool written = ::write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  ::close(fd);
  if (!written) return refuse(path, "cannot write the token");
  return path;
}

}  // namespace prism::prismweb
