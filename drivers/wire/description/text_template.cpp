// SPDX-License-Identifier: MIT
#include "drivers/wire/description/text_template.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace prism::wire {
namespace {

/// {field:form} of a template.
struct Placeholder {
  std::string_view field, form;
};

Placeholder placeholder(std::string_view inner) {
  const std::size_t colon = inner.find(':');
  return {inner.substr(0, colon), colon == std::string_view::npos ? std::string_view() : inner.substr(colon + 1)};
}

std::string print_number(std::string_view form, double number, char point = '.') {
  const bool whole = form.ends_with('d') || form.ends_with('x') || form.ends_with('X');
  const std::string pattern = fmt::format("{{:{}}}", form);
  std::string text =
      whole ? fmt::format(fmt::runtime(pattern), std::llround(number)) : fmt::format(fmt::runtime(pattern), number);
  std::replace(text.begin(), text.end(), '.', point);
  return text;
}

std::string print_hex(const Field& field, double number) {
  std::string text(field.size, '0');
  store_number(field, reinterpret_cast<std::uint8_t*>(text.data()), number);
  return text;
}

/// True for a text check at the end of the line; the template has the place of others.
bool is_appended(const CheckRule& check, const LengthRule& length) {
  if (check.stored == CheckRule::Stored::kBinary) return false;
  return check.separator != 0 || check.at == -static_cast<int>(printed_digits(check) + length.terminator.size());
}

}  // namespace

std::string template_fault(const MessageType& kind) {
  const std::string_view text = kind.text.write;
  for (std::size_t at = text.find_first_of("{}"); at != std::string_view::npos; at = text.find_first_of("{}", at)) {
    const std::size_t close = text.find('}', at);
    if (text[at] == '}' || close == std::string_view::npos) return "has an unmatched brace";
    const Placeholder number = placeholder(text.substr(at + 1, close - at - 1));
    if (kind.field_index(number.field) < 0)
      return fmt::format("names \"{}\", which is not a field of this message type", number.field);
    if (kind.fields[static_cast<std::size_t>(kind.field_index(number.field))].is_hex()) {
      if (!number.form.empty())
        return fmt::format("has the form \"{}\"; expected none, because \"{}\" has the width of its type", number.form,
                           number.field);
      at = close + 1;
      continue;
    }
    try {
      print_number(number.form, 0);
    } catch (const fmt::format_error&) {
      return fmt::format("has the form \"{}\"; expected one like 9.6f, d or 08x", number.form);
    }
    at = close + 1;
  }
  return {};
}

std::vector<std::uint8_t> print_frame(const MessageType& kind, std::span<const double> raw) {
  std::string out;
  std::string_view left = kind.text.write;
  while (!left.empty()) {
    const std::size_t open = left.find('{');
    out += left.substr(0, open);
    if (open == std::string_view::npos) break;
    const std::size_t close = left.find('}', open);
    const Placeholder number = placeholder(left.substr(open + 1, close - open - 1));
    const auto index = static_cast<std::size_t>(kind.field_index(number.field));
    out += kind.fields[index].is_hex() ? print_hex(kind.fields[index], raw[index])
                                       : print_number(number.form, raw[index], kind.text.point);
    left.remove_prefix(close + 1);
  }
  for (const CheckRule& check : kind.checks) {
    if (is_appended(check, kind.length)) out.append(printed_digits(check), '0');
  }
  std::vector<std::uint8_t> frame(out.begin(), out.end());
  frame.insert(frame.end(), kind.length.terminator.begin(), kind.length.terminator.end());
  return frame;
}

}  // namespace prism::wire
