// SPDX-License-Identifier: MIT
// Parses numbers printed by a device.
#pragma once

#include <string_view>

namespace prism::wire {

/// Blanks around it, a sign, digits, `point` before the decimals, and an exponent (e or E, a sign, digits). Returns
/// kUnknown if the text is anything else or the number is outside the range of a double.
double parse_decimal(std::string_view text, char point);

}  // namespace prism::wire
