// SPDX-License-Identifier: MIT
// termios2 in a file of its own: <asm/termbits.h> and <termios.h> cannot be included in the same file.
#pragma once

#include <optional>

#include "drivers/wire/description/wire_format.hpp"

namespace prism::transport {

/// Makes the line raw (no echo, no flow control, no translation; VMIN 1, VTIME 0), with this speed and character
/// format. False, with errno, where the driver refuses; true says little: read the format back.
bool set_line_format(int fd, const wire::WireFormat& format);

/// The format that the driver says is in force; nothing, with errno, where it cannot say (EIO: unplugged).
std::optional<wire::WireFormat> read_line_format(int fd);

}  // namespace prism::transport
