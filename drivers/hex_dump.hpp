// SPDX-License-Identifier: MIT
// Hex dumps as text: of terminal programs, xxd, hexdump -C and socat -x.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace prism::drivers {

/// The bytes of a text in which almost every line is a dump of bytes: two digits each, separated by blanks, with or
/// without an offset, a column of characters, a time stamp and a direction mark (RX, TX, <, >). Of two directions the
/// one with more bytes counts. nullopt: the text is something else. `text` may end within a line.
std::optional<std::vector<std::uint8_t>> bytes_of_hex_dump(std::string_view text);

/// The first bytes of a longer text without its last line, which they may cut; of a text in one line without the last
/// word, or without the last digit of an odd number of digits.
std::string_view whole_part(std::string_view first);

}  // namespace prism::drivers
