// SPDX-License-Identifier: MIT
#include "tools/prismweb/token_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
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

}  // namespace

// In a folder that others may write a file of this name may be theirs: it is made anew, never written into.
Result<std::string> write_token(const std::string& token, int port) {
  std::string path = fmt::format("{}/prismweb-{}.token", runtime_folder(), port);
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
