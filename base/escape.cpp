// SPDX-License-Identifier: MIT
#include "base/escape.hpp"

#include <fmt/format.h>
#include <utf8.h>

#include <algorithm>
#include <charconv>
#include <iterator>

#include "base/outside_text.hpp"

namespace prism {
namespace {

constexpr std::string_view kReplacement = "\xef\xbf\xbd";  // U+FFFD

/// Calls `code(result, character, its bytes)` for each valid character and `byte(result, b)` for each invalid byte:
/// they append to the result.
template <class Code, class Byte>
std::string rewritten(std::string_view text, Code&& code, Byte&& byte) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const auto invalid = utf8::find_invalid(text.begin(), text.end());
    for (auto at = text.begin(); at != invalid;) {
      const auto begin = at;
      const char32_t character = utf8::unchecked::next(at);
      code(result, character, std::string_view(begin, at));
    }
    text.remove_prefix(static_cast<std::size_t>(invalid - text.begin()));
    if (text.empty()) break;
    byte(result, static_cast<unsigned char>(text.front()));
    text.remove_prefix(1);
  }
  return result;
}

void put_replacement(std::string& result, unsigned char) { result += kReplacement; }

bool is_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

bool is_formula(std::string_view text) {
  return !text.empty() &&
         (std::string_view("=+-@").find(text.front()) != std::string_view::npos ||
          static_cast<unsigned char>(text.front()) < 0x20) &&
         !is_number(text);
}

}  // namespace

std::string printable(std::string_view text, bool keeps_lines) {
  return rewritten(
      text,
      [=](std::string& result, char32_t code, std::string_view bytes) {
        if (is_printable_code(code) || (keeps_lines && code == '\n')) {
          result += bytes;
        } else if (code < 0x80) {
          fmt::format_to(std::back_inserter(result), "\\x{:02x}", static_cast<unsigned>(code));
        } else {
          fmt::format_to(std::back_inserter(result), "\\u{{{:04x}}}", static_cast<unsigned>(code));
        }
      },
      [](std::string& result, unsigned char byte) { fmt::format_to(std::back_inserter(result), "\\x{:02x}", byte); });
}

// JSON has non-printable characters only within strings, except line ends. In a string \uHHHH is the same character.
std::string printable_json(std::string_view json) {
  const auto put_unit = [](std::string& result, char32_t code) {
    fmt::format_to(std::back_inserter(result), "\\u{:04x}", static_cast<unsigned>(code));
  };
  return rewritten(
      json,
      [&](std::string& result, char32_t code, std::string_view bytes) {
        if (is_printable_code(code) || code == '\n') {
          result += bytes;
        } else if (code < 0x10000) {
          put_unit(result, code);
        } else {  // a pair of surrogates
          put_unit(result, 0xd800 + ((code - 0x10000) >> 10));
          put_unit(result, 0xdc00 + ((code - 0x10000) & 0x3ff));
        }
      },
      put_replacement);
}

std::string_view utf8_prefix(std::string_view text, std::size_t max) {
  if (text.size() <= max) return text;
  while (max > 0 && (static_cast<unsigned char>(text[max]) & 0xc0) == 0x80) --max;
  return text.substr(0, max);
}

std::string shortened(std::string_view text, std::size_t max) {
  return printable(utf8_prefix(text, max)) + (text.size() > max ? "..." : "");
}

std::string html_text(std::string_view text) {
  constexpr std::string_view kMarks = "&<>\"'";
  constexpr const char* kEntities[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  return rewritten(
      text,
      [&](std::string& result, char32_t code, std::string_view bytes) {
        if (const std::size_t mark = kMarks.find(bytes); mark != kMarks.npos)
          result += kEntities[mark];
        else
          result += is_printable_code(code) || code == '\n' || code == '\t' ? bytes : kReplacement;
      },
      put_replacement);
}

std::string valid_utf8(std::string_view text) {
  return rewritten(
      text, [](std::string& result, char32_t, std::string_view bytes) { result += bytes; }, put_replacement);
}

std::string csv_cell(std::string_view text) {
  std::string cell = (is_formula(text) ? "'" : "") + valid_utf8(text);
  if (cell.find_first_of(",;\"\t\r\n") == cell.npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string shell_word(std::string_view text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=,+@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == text.npos) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + '\'';
}

}  // namespace prism
