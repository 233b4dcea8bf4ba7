// SPDX-License-Identifier: MIT
// Parses numbers printed by a device.
#pragma once

#include <string_view>

namespace prism::wire {

/// Blanks around it, a sign, digits, and `point` before the decimals; kUnknown if the text is anything else.
double parse_decimal(std::string_view text, char point);

}  // namespace prism::wire
