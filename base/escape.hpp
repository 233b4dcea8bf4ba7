// SPDX-License-Identifier: MIT
// Makes external text safe for one output language. Every program writes text with these functions.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace prism {

/// For terminals, log lines and messages: printable UTF-8 is unchanged; other characters become \xHH (bytes) or
/// \u{HHHH}. The result contains no line end (except with `keeps_lines`) and no escape sequence.
std::string printable(std::string_view text, bool keeps_lines = false);

/// The first `max` bytes of `text`, a few less if the limit is inside a character.
std::string_view utf8_prefix(std::string_view text, std::size_t max);

/// printable() of at most `max` bytes; "..." marks the cut.
std::string shortened(std::string_view text, std::size_t max = 60);

/// JSON text for a terminal: the same value; non-printable characters in strings become \uHHHH. Line ends stay.
std::string printable_json(std::string_view json);

/// Several lines for a terminal: printable(), but line ends stay.
inline std::string printable_lines(std::string_view text) { return printable(text, true); }

/// For HTML and SVG, as text and in quoted attributes: & < > " ' become entities. Line ends and tabs are unchanged;
/// other non-printable characters become U+FFFD.
std::string html_text(std::string_view text);

/// Valid UTF-8: bytes that are not part of a character become U+FFFD.
std::string valid_utf8(std::string_view text);

/// One cell of a CSV table for a spreadsheet (RFC 4180). A spreadsheet reads a cell as a formula if it begins with = +
/// - @ or a control character and is not a number. Such a cell gets an apostrophe in front, which shows it as text
/// (OWASP, CSV injection).
std::string csv_cell(std::string_view text);

/// One word of a command line for a POSIX shell: in quotes if it needs them.
std::string shell_word(std::string_view text);

/// JSON text of a value (any nlohmann type). Never throws: bytes that are not UTF-8 become U+FFFD, NaN becomes null.
template <class AnyJson>
std::string json_text(const AnyJson& value, int indent = -1) {
  return value.dump(indent, ' ', false, AnyJson::error_handler_t::replace);
}

}  // namespace prism
