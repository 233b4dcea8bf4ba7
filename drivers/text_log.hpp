// SPDX-License-Identifier: MIT
// Logs of terminal programs with one sentence in each line, as of NMEA 0183.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace prism::drivers {

/// The sentences of a text in which almost every line ends with one ("$…*HH"), each with CR LF, as a device sends them:
/// without the stamps before them, and with the CR that a program removed. nullopt: the text is something else, or is
/// already what the device sends. A checksum of two digits must hold. `text` may end within a line.
std::optional<std::vector<std::uint8_t>> bytes_of_text_log(std::string_view text);

/// Returns true for such a text, also if it is already what the device sends.
bool is_text_log(std::string_view text);

}  // namespace prism::drivers
