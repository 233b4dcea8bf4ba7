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

// Does not wait: a connect to a socket whose queue is full would block until its owner accepts, which may be never.
bool somebody_listens(const sockaddr* address, socklen_t size) {
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
    return refuse(path, fmt::format("has {} bytes, expected at most {}", path.size(), sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const auto* const place = reinterpret_cast<const sockaddr*>(&address);
  struct stat info {};
  if (::lstat(path.c_str(), &info) == 0) {
    if (!S_ISSOCK(info.st_mode)) return refuse(path, "is there and is no socket; expected a free path");
    if (somebody_listens(place, sizeof address))
      return refuse(path, "another process listens there; expected a free path");
    ::unlink(path.c_str());
  }
  const auto failed = [&path](const char* what) {
    return refuse(path, fmt::format("{}: {}", what, std::strerror(errno)));
  };
  Descriptor socket = new_socket();
  const mode_t before = ::umask(0777);  // nobody enters before the mode is right
  const bool bound = ::bind(socket.get(), place, sizeof address) == 0;
  const int error = errno;
  ::umask(before);
  errno = error;
  if (!bound) return failed("cannot be made");
  if (::chmod(path.c_str(), mode) != 0) return failed("its mode cannot be set");
  if (::listen(socket.get(), SOMAXCONN) != 0) return failed("cannot listen");
  return socket;
}

}  // namespace prism
