// SPDX-License-Identifier: MIT
#include "base/unix_socket.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace prism {
namespace {

Descriptor new_socket() { return Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)); }

// Does not wait: a blocking connect to a socket with a full queue would wait until its owner accepts, perhaps forever.
bool has_listener(const sockaddr* address, socklen_t size) {
  const Descriptor probe = new_socket();
  return ::connect(probe.get(), address, size) == 0 || errno == EAGAIN;
}

}  // namespace

OwnSocketFile::~OwnSocketFile() {
  if (own_ && FileId::of(path_) == own_) ::unlink(path_.c_str());
}

Result<Descriptor> listen_unix(const std::string& path, mode_t mode) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    return make_error(path, fmt::format("has {} bytes, expected at most {}", path.size(), sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const auto* const place = reinterpret_cast<const sockaddr*>(&address);
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0) {
    if (!S_ISSOCK(info.st_mode)) return make_error(path, "exists but is not a socket; expected a free path");
    if (has_listener(place, sizeof address))
      return make_error(path, "another process listens there; expected a free path");
    ::unlink(path.c_str());
  }
  const auto failed = [&path](const char* what) {
    return make_error(path, fmt::format("{}: {}", what, std::strerror(errno)));
  };
  Descriptor socket = new_socket();
  const mode_t before = ::umask(0777);  // no process can connect before the mode is set
  const bool bound = ::bind(socket.get(), place, sizeof address) == 0;
  const int error = errno;
  ::umask(before);
  errno = error;
  if (!bound) return failed("cannot be created");
  if (::chmod(path.c_str(), mode) != 0) return failed("cannot set its mode");
  if (::listen(socket.get(), SOMAXCONN) != 0) return failed("cannot listen");
  return socket;
}

}  // namespace prism
