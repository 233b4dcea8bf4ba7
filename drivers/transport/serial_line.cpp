// SPDX-License-Identifier: MIT
#include "drivers/transport/serial_line.hpp"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/plain_text.hpp"

namespace prism::transport {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kShown = 3;

bool has_open(const fs::path& process, const fs::path& device) {
  std::error_code error;
  fs::directory_iterator entry(process / "fd", error), end;
  for (; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (fs::read_symlink(entry->path(), unreadable) == device && !unreadable) return true;
  }
  return false;
}

constexpr double kBaudTolerance = 0.02;  // a receiver samples the last of ten bits: its limit is 5 %, 2 % leaves margin

unsigned character_flags(const wire::WireFormat& format) {
  constexpr unsigned kSizes[]{CS5, CS6, CS7, CS8};
  unsigned flags = kSizes[std::clamp(format.data_bits, 5, 8) - 5];
  if (format.parity != wire::Parity::kNone) flags |= PARENB;
  if (format.parity == wire::Parity::kOdd) flags |= PARODD;
  if (format.stop_bits == 2) flags |= CSTOPB;
  return flags;
}

// BOTHER with a number in c_ospeed is the only way to 614 400 or 374 400 baud. CIBAUD stays 0: the input's speed equals
// the output's. INPCK stays off: a byte with wrong parity is passed unchanged and the frame's check detects it, whereas
// IGNPAR would shift the rest of the frame.
bool set_line_format(int fd, const wire::WireFormat& format) {
  struct termios2 line;
  if (::ioctl(fd, TCGETS2, &line) != 0) return false;
  line.c_iflag = 0;
  line.c_oflag = 0;
  line.c_lflag = 0;
  line.c_cflag = CREAD | CLOCAL | BOTHER | character_flags(format);
  line.c_ispeed = line.c_ospeed = static_cast<speed_t>(format.baud);
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
  return ::ioctl(fd, TCSETS2, &line) == 0;
}

std::string format_text(const wire::WireFormat& format) {
  return fmt::format("{} baud, {} data bits, parity {}, {}", format.baud, format.data_bits,
                     wire::kParities[static_cast<std::size_t>(format.parity)],
                     counted(static_cast<std::size_t>(format.stop_bits), "stop bit"));
}

std::string why_not_open(int error) {
  switch (error) {
    case ENOENT:
      return "not there; expected a serial device";
    case EACCES:
      return "no permission; expected read and write (on Debian the group dialout has it)";
    case EBUSY:
      return "held by another program; expected it free";
    case ENXIO:
    case ENODEV:
      return "no device connected; expected a serial device";
    default:
      return fmt::format("cannot be opened: {}", std::strerror(error));
  }
}

// Linux gives the slaves of pseudo-terminals the major numbers 136 to 143.
bool is_pseudo_terminal(int fd) {
  struct stat status;
  if (::fstat(fd, &status) != 0) return false;
  const unsigned number = major(status.st_rdev);
  return S_ISCHR(status.st_mode) && number >= 136 && number <= 143;
}

// flock keeps out programs that use locks; TIOCEXCL the others, except root. Not set on a
// pseudo-terminal, whose other end belongs to our tests.
Result<void> claim(const std::string& device, int fd, bool pseudo) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    return make_error(
        device, errno == EWOULDBLOCK ? why_not_open(EBUSY) : fmt::format("cannot lock: {}", std::strerror(errno)));
  }
  if (!pseudo) ::ioctl(fd, TIOCEXCL);
  return {};
}

Result<void> set_and_compare(const Settings& settings, int fd, bool pseudo, std::vector<std::string>& notes) {
  const wire::WireFormat& wanted = settings.format;
  if (!set_line_format(fd, wanted)) {
    return make_error(settings.device, fmt::format("does not take {}: {}", format_text(wanted), std::strerror(errno)));
  }
  const std::optional<wire::WireFormat> found = read_line_format(fd);
  if (!found)
    return make_error(settings.device, fmt::format("cannot read the settings back: {}", std::strerror(errno)));
  const bool same_speed = std::abs(found->baud - wanted.baud) <= kBaudTolerance * wanted.baud;
  const bool same_characters =
      found->data_bits == wanted.data_bits && found->parity == wanted.parity && found->stop_bits == wanted.stop_bits;
  if (same_speed && same_characters) return {};
  const std::string what = fmt::format("found {} in force, expected {}", format_text(*found), format_text(wanted));
  if (!pseudo) return make_error(settings.device, what);
  notes.push_back(what + "; no effect on a pseudo-terminal");
  return {};
}

// Asks the driver to deliver bytes at once (FTDI: 1 ms instead of 16).
bool set_low_latency(int fd) {
  struct serial_struct serial;
  if (::ioctl(fd, TIOCGSERIAL, &serial) != 0) return false;
  serial.flags |= ASYNC_LOW_LATENCY;
  return ::ioctl(fd, TIOCSSERIAL, &serial) == 0;
}

// The device behind an open descriptor was unplugged or hung up: read() then always returns 0. A pseudo-terminal and
// some drivers also return 0 if no data are available.
bool is_gone(int fd) {
  struct termios2 unused;
  return ::ioctl(fd, TCGETS2, &unused) != 0;
}

using Stream = boost::asio::posix::stream_descriptor;

class SerialLine : public Transport {
 public:
  SerialLine(boost::asio::io_context& io, std::string device, Descriptor fd, std::vector<std::string> notes)
      : device_(std::move(device)), fd_(fd.get()), notes_(std::move(notes)), stream_(io, fd.release()) {}

  void wait(Ready ready) override { stream_.async_wait(Stream::wait_read, std::move(ready)); }
  int fd() override { return fd_; }
  std::vector<std::string> notes() const override { return notes_; }

  Received read(std::span<std::uint8_t> buffer) override {
    const ssize_t size = ::read(fd_, buffer.data(), buffer.size());
    if (size > 0) return {Received::Kind::kData, static_cast<std::size_t>(size)};
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return {};
    if (size < 0) return {.kind = Received::Kind::kLost, .why = std::strerror(errno)};
    if (is_gone(fd_)) return {.kind = Received::Kind::kLost, .why = "unplugged (end of file)"};
    return {Received::Kind::kEmpty};
  }

  Result<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    const ssize_t size = ::write(fd_, bytes.data(), bytes.size());
    if (size >= 0) return static_cast<std::size_t>(size);
    if (errno == EAGAIN || errno == EINTR) return 0;
    return make_error(device_, std::string("cannot write: ") + std::strerror(errno));
  }

  bool has_unread() const override {
    int bytes = 0;
    return ::ioctl(fd_, FIONREAD, &bytes) == 0 && bytes > 0;
  }

  // Pseudo-terminals and some USB adapters do not count.
  std::optional<LineCounters> counters() const override {
    struct serial_icounter_struct counted {};
    if (::ioctl(fd_, TIOCGICOUNT, &counted) != 0) return std::nullopt;
    return LineCounters{counted.rx, counted.frame, counted.parity, counted.overrun, counted.brk, counted.buf_overrun};
  }

 private:
  const std::string device_;
  const int fd_;
  const std::vector<std::string> notes_;
  Stream stream_;  // closes fd_
};

}  // namespace

std::string other_users_of(const std::string& device) {
  std::error_code error;
  const fs::path canonical = fs::canonical(device, error);
  if (error) return {};
  const std::string own = std::to_string(::getpid());
  std::vector<std::string> users;
  fs::directory_iterator entry("/proc", error), end;
  for (; !error && entry != end && users.size() < kShown; entry.increment(error)) {
    const std::string pid = entry->path().filename();
    if (!std::all_of(pid.begin(), pid.end(), [](unsigned char c) { return std::isdigit(c) != 0; }) || pid == own)
      continue;
    if (!has_open(entry->path(), canonical)) continue;
    const auto name = read_text_file(entry->path() / "comm");
    users.push_back(fmt::format("{} (pid {})", name ? printable(name->substr(0, name->find('\n'))) : "a program", pid));
  }
  return fmt::to_string(fmt::join(users, ", "));
}

std::optional<wire::WireFormat> read_line_format(int fd) {
  struct termios2 line;
  if (::ioctl(fd, TCGETS2, &line) != 0) return std::nullopt;
  wire::WireFormat format;
  format.baud = static_cast<int>(line.c_ospeed);
  const unsigned size = line.c_cflag & CSIZE;
  format.data_bits = size == CS5 ? 5 : size == CS6 ? 6 : size == CS7 ? 7 : 8;
  format.parity = !(line.c_cflag & PARENB)  ? wire::Parity::kNone
                  : (line.c_cflag & PARODD) ? wire::Parity::kOdd
                                            : wire::Parity::kEven;
  format.stop_bits = (line.c_cflag & CSTOPB) ? 2 : 1;
  return format;
}

Result<std::unique_ptr<Transport>> open_serial_line(boost::asio::io_context& io, const Settings& settings) {
  Descriptor file(::open(settings.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  const int fd = file.get();
  if (fd < 0) return make_error(settings.device, why_not_open(errno));
  if (!::isatty(fd)) return make_error(settings.device, "not a terminal; expected a serial device");
  const bool pseudo = is_pseudo_terminal(fd);
  std::vector<std::string> notes;
  if (auto claimed = claim(settings.device, fd, pseudo); !claimed) return tl::unexpected<Error>(claimed.error());
  if (auto set = set_and_compare(settings, fd, pseudo, notes); !set) return tl::unexpected<Error>(set.error());
  ::ioctl(fd, TCFLSH, TCIFLUSH);
  if (!pseudo && !set_low_latency(fd)) {
    notes.push_back(fmt::format("no low latency: {}; bytes may come in bunches (FTDI: set latency_timer by udev)",
                                std::strerror(errno)));
  }
  return std::make_unique<SerialLine>(io, settings.device, std::move(file), std::move(notes));
}

}  // namespace prism::transport
