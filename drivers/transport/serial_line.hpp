// SPDX-License-Identifier: MIT
// Opens a serial line the way a measuring instrument needs it: any speed, raw, alone, and read back.
#pragma once

#include "drivers/transport/transport.hpp"

namespace prism::transport {

/// Opens, locks and sets the line; reads the settings back and compares. The descriptor does not block and is not
/// inherited. Input from before is discarded: its time of arrival is unknown. Refused with the device's name: not
/// there, no tty, held by another program, no permission, or a speed or a character format that the device does not
/// take. A pseudo-terminal has no parity and no speed: what it ignores becomes a note.
Result<std::unique_ptr<Transport>> open_serial_line(const Settings& settings);

std::string describe_serial_line(const Settings& settings);
bool serial_line_is_present(const Settings& settings);

}  // namespace prism::transport
