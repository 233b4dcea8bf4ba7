// SPDX-License-Identifier: MIT
// Bytes written in hexadecimal digits.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace prism {

/// "A5 5A" → bytes; empty if the text is anything else.
std::vector<std::uint8_t> hex_bytes(std::string_view text);

}  // namespace prism
