// SPDX-License-Identifier: MIT
// Numbers that a device prints.
#pragma once

#include <string_view>

namespace prism::wire {

/// Blanks around it, a sign, digits, and `point` before the decimals; kUnknown where the text is anything else.
double parse_decimal(std::string_view text, char point);

}  // namespace prism::wire
