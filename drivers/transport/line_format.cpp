// SPDX-License-Identifier: MIT
#include "drivers/transport/line_format.hpp"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <algorithm>

namespace prism::transport {
namespace {

unsigned character_flags(const wire::WireFormat& format) {
  constexpr unsigned kSizes[]{CS5, CS6, CS7, CS8};
  unsigned flags = kSizes[std::clamp(format.data_bits, 5, 8) - 5];
  if (format.parity != wire::Parity::kNone) flags |= PARENB;
  if (format.parity == wire::Parity::kOdd) flags |= PARODD;
  if (format.stop_bits == 2) flags |= CSTOPB;
  return flags;
}

}  // namespace

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

}  // namespace prism::transport
