// SPDX-License-Identifier: MIT
// termios2 functions in their own file: <asm/termbits.h> and <termios.h> cannot be included together.
#pragma once

#include <optional>

#include "drivers/wire/description/wire_format.hpp"

namespace prism::transport {

/// Makes the line raw (no echo, no flow control, no translation; VMIN 1, VTIME 0), with this speed and character
/// format. Returns false, with errno, if the driver rejects it. Drivers may ignore parts: read the format back.
bool set_line_format(int fd, const wire::WireFormat& format);

/// The format that the driver reports; nullopt, with errno, if it cannot (EIO: unplugged).
std::optional<wire::WireFormat> read_line_format(int fd);

}  // namespace prism::transport
