// SPDX-License-Identifier: MIT
#include "tools/prismsim/pseudo_terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

namespace prism::prismsim {
namespace {

namespace fs = std::filesystem;

Result<void> make_link(const std::string& link, const std::string& target) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(link, error);
  if (fs::exists(status) && !fs::is_symlink(status))
    return make_error(link, "exists but is not a symbolic link; expected a free name");
  fs::remove(link, error);
  fs::create_symlink(target, link, error);
  if (error) return make_error(link, fmt::format("cannot create the link: {}", error.message()));
  return {};
}

// Raw from the start: until the reader sets it, too, an echoing terminal would send everything back.
bool make_raw(int fd) {
  struct termios line;
  if (::tcgetattr(fd, &line) != 0) return false;
  ::cfmakeraw(&line);
  return ::tcsetattr(fd, TCSANOW, &line) == 0;
}

}  // namespace

Result<PseudoTerminal> PseudoTerminal::open(const std::string& link) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  char path[128] = "";
  if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0 || ::ptsname_r(master, path, sizeof path) != 0) {
    const std::string why = std::strerror(errno);
    if (master >= 0) ::close(master);
    return make_error("/dev/ptmx", "cannot open a pseudo-terminal: " + why);
  }
  PseudoTerminal terminal(master, path);
  // After the other end was opened and closed once, it counts as closed until a program opens it: has_reader() works
  // from the start.
  const int slave = ::open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
  const bool raw = slave >= 0 && make_raw(slave);
  if (slave >= 0) ::close(slave);
  if (!raw) return make_error(path, fmt::format("cannot set it up: {}", std::strerror(errno)));
  if (!link.empty()) {
    if (auto made = make_link(link, path); !made) return tl::unexpected<Error>(made.error());
    terminal.link_ = link;
  }
  return terminal;
}

PseudoTerminal::PseudoTerminal(PseudoTerminal&& other) noexcept
    : master_(std::exchange(other.master_, -1)), path_(std::move(other.path_)), link_(std::exchange(other.link_, "")) {}

PseudoTerminal::~PseudoTerminal() {
  std::error_code ignored;
  if (!link_.empty() && fs::read_symlink(link_, ignored) == path_) fs::remove(link_, ignored);
  if (master_ >= 0) ::close(master_);
}

bool PseudoTerminal::has_reader() {
  pollfd ends{master_, 0, 0};
  ::poll(&ends, 1, 0);
  return !(ends.revents & POLLHUP);
}

std::size_t PseudoTerminal::write_some(std::span<const std::uint8_t> bytes) {
  const ssize_t written = ::write(master_, bytes.data(), bytes.size());
  return written > 0 ? static_cast<std::size_t>(written) : 0;
}

std::size_t PseudoTerminal::read_some(std::span<std::uint8_t> bytes) {
  const ssize_t size = ::read(master_, bytes.data(), bytes.size());
  return size > 0 ? static_cast<std::size_t>(size) : 0;
}

void PseudoTerminal::wait_for_room(int milliseconds) {
  pollfd room{master_, POLLOUT, 0};
  ::poll(&room, 1, milliseconds);
}

// The master cannot query how much its reader has not read. Opening the other end for a moment shows it: poll() there
// first transfers the pending bytes, then reports whether there are any.
bool PseudoTerminal::is_drained() {
  if (!has_reader()) return true;
  const int slave = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (slave < 0) return true;
  pollfd waiting{slave, POLLIN, 0};
  const bool readable = ::poll(&waiting, 1, 0) == 1;
  ::close(slave);
  return !readable;
}

}  // namespace prism::prismsim
