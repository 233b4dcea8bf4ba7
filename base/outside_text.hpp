// SPDX-License-Identifier: MIT
// One rule for each type of name and text from a file, a device, a command line or a network.
#pragma once

#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism {

/// Rule for a text. "Printable" is valid UTF-8 without control characters, line and paragraph separators,
/// invisible or bidirectional format characters (Unicode categories Cc, Cf, Zl, Zp) and noncharacters.
enum class TextRule {
  kAxisName,     ///< 1 to 16 ASCII letters, digits or _
  kSensorName,   ///< a letter, then ASCII letters, digits or _, at most 32; joined by '.' at most 65 (LINE.SENSOR)
  kMessageName,  ///< as kSensorName, but a digit or _ may be first
  kName,      ///< 1 to 90 bytes, printable, without '/', no '.' or blank first, no blank last; instances, models, …
  kText,      ///< at most 128 bytes, printable, no blank first or last; serial numbers, …
  kLongText,  ///< at most 4096 bytes, printable; paths, sources, reasons
};

/// True if a character is printable (see TextRule).
bool is_printable_code(char32_t code);

/// True if `text` is printable (see TextRule).
bool is_printable(std::string_view text);

/// True if `text` follows the rule.
bool follows(TextRule rule, std::string_view text);

/// The rule as text, to follow "expected".
const char* rule_text(TextRule rule);

/// Error if `text` does not follow the rule: "WHERE: found \"TEXT\", expected RULE".
Result<void> check_text(TextRule rule, std::string_view text, std::string where);

}  // namespace prism
