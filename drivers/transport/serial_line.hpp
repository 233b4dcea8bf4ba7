// SPDX-License-Identifier: MIT
// Opens a serial line for measurement: any speed, raw, exclusive, with its settings verified.
#pragma once

#include <optional>
#include <string>

#include "drivers/transport/transport.hpp"

namespace prism::transport {

// Other programs that have a device open: they may read its data.

/// "cat (pid 4711), minicom (pid 4712)": at most 3 programs, from /proc as far as it can be read; empty: none is known.
/// `device` may be a symbolic link.
std::string other_users_of(const std::string& device);

/// Opens, locks and sets the line; reads the settings back and compares them. The descriptor is non-blocking and not
/// inherited. Discards pending input, since its arrival time is unknown. Errors: missing, not a tty, in use by another
/// program, no permission, or a speed or character format that the device rejects. A pseudo-terminal has no parity and
/// no speed: each ignored setting becomes a note.
Result<std::unique_ptr<Transport>> open_serial_line(boost::asio::io_context& io, const Settings& settings);

/// The speed and character format that the driver reports; nullopt, with errno, if it cannot (EIO: unplugged).
std::optional<wire::WireFormat> read_line_format(int fd);

}  // namespace prism::transport
