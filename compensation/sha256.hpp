// SPDX-License-Identifier: MIT
// SHA-256 (FIPS 180-4) of a text, as 64 hexadecimal digits: the id of models and files.
#pragma once

#include <string>
#include <string_view>

namespace prism {

std::string sha256_hex(std::string_view bytes);

}  // namespace prism
