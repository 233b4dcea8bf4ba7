// SPDX-License-Identifier: MIT
#include "base/outside_text.hpp"

#include <utf8.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "base/escape.hpp"

namespace prism {
namespace {

struct CodeRange {
  char32_t first, last;
};

// Unicode 15: control, format, line and paragraph separators, noncharacters of the basic plane. Sorted.
constexpr std::array kNotPrintable = {
    CodeRange{0x0000, 0x001f},   CodeRange{0x007f, 0x009f},   CodeRange{0x00ad, 0x00ad},   CodeRange{0x0600, 0x0605},
    CodeRange{0x061c, 0x061c},   CodeRange{0x06dd, 0x06dd},   CodeRange{0x070f, 0x070f},   CodeRange{0x0890, 0x0891},
    CodeRange{0x08e2, 0x08e2},   CodeRange{0x180e, 0x180e},   CodeRange{0x200b, 0x200f},   CodeRange{0x2028, 0x202e},
    CodeRange{0x2060, 0x206f},   CodeRange{0xfdd0, 0xfdef},   CodeRange{0xfeff, 0xfeff},   CodeRange{0xfff0, 0xfffb},
    CodeRange{0xfffe, 0xffff},   CodeRange{0x110bd, 0x110bd}, CodeRange{0x110cd, 0x110cd}, CodeRange{0x13430, 0x1343f},
    CodeRange{0x1bca0, 0x1bca3}, CodeRange{0x1d173, 0x1d17a}, CodeRange{0xe0000, 0xe0fff}};

bool is_word(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }

bool is_word_text(std::string_view text, std::size_t max) {
  return !text.empty() && text.size() <= max && std::all_of(text.begin(), text.end(), is_word);
}

/// Words of at most 32 characters, joined by dots; 65 characters in all: LINE.SENSOR.
bool is_dotted_name(std::string_view text) {
  if (text.size() > 65) return false;
  for (std::size_t dot = text.find('.'); dot != text.npos; dot = text.find('.')) {
    if (!is_word_text(text.substr(0, dot), 32)) return false;
    text.remove_prefix(dot + 1);
  }
  return is_word_text(text, 32);
}

bool is_letter(char c) { return is_word(c) && c > '9' && c != '_'; }

bool is_free_text(std::string_view text, std::size_t max) { return text.size() <= max && is_printable(text); }

bool has_blank_end(std::string_view text) { return text.starts_with(' ') || text.ends_with(' '); }

bool is_name(std::string_view text) {
  return !text.empty() && is_free_text(text, 90) && text.find('/') == text.npos && !text.starts_with('.') &&
         !has_blank_end(text);
}

struct RuleRow {
  const char* text;
  bool (*holds)(std::string_view text);
};

const RuleRow& row_of(TextRule rule) {
  static constexpr RuleRow kRows[] = {
      // in the order of TextRule
      {"1 to 16 letters, digits or _", [](std::string_view text) { return is_word_text(text, 16); }},
      {"a letter, then letters, digits or _, at most 32; '.' may join two such names",
       [](std::string_view text) { return is_dotted_name(text) && is_letter(text.front()); }},
      {"1 to 32 letters, digits or _; '.' may join two such names", is_dotted_name},
      {"1 to 90 bytes of printable text without '/', no '.' first, no blank at either end", is_name},
      {"at most 128 bytes of printable text, no blank at either end",
       [](std::string_view text) { return is_free_text(text, 128) && !has_blank_end(text); }},
      {"at most 4096 bytes of printable text", [](std::string_view text) { return is_free_text(text, 4096); }}};
  return kRows[static_cast<std::size_t>(rule)];
}

}  // namespace

bool is_printable_code(char32_t code) {
  const auto range = std::lower_bound(kNotPrintable.begin(), kNotPrintable.end(), code,
                                      [](const CodeRange& r, char32_t c) { return r.last < c; });
  const bool in_range = range != kNotPrintable.end() && code >= range->first;
  return !in_range && (code & 0xfffe) != 0xfffe;
}

bool is_printable(std::string_view text) {
  if (utf8::find_invalid(text.begin(), text.end()) != text.end()) return false;
  for (auto at = text.begin(); at != text.end();) {
    if (!is_printable_code(utf8::unchecked::next(at))) return false;
  }
  return true;
}

bool follows(TextRule rule, std::string_view text) { return row_of(rule).holds(text); }

const char* rule_text(TextRule rule) { return row_of(rule).text; }

Result<void> check_text(TextRule rule, std::string_view text, std::string where) {
  if (follows(rule, text)) return {};
  return make_error(std::move(where), "found \"" + shortened(text) + "\", expected " + rule_text(rule));
}

}  // namespace prism
