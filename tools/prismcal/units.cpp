// SPDX-License-Identifier: MIT
#include "tools/prismcal/units.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

namespace prism::tables {

std::string lower(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    // The sign U+00BA and the ring U+02DA stand for the degree sign in some exports.
    const std::string_view rest = text.substr(i);
    if (rest.starts_with("\xC2\xBA") || rest.starts_with("\xCB\x9A")) {
      out += "°";
      ++i;
    } else {
      out.push_back(text[i] >= 'A' && text[i] <= 'Z' ? static_cast<char>(text[i] + 32) : text[i]);
    }
  }
  return out;
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

std::vector<std::string> list_items(std::string_view text) {
  std::vector<std::string> items;
  for (std::size_t begin = 0, end = 0; !text.empty() && begin <= text.size(); begin = end + 1) {
    end = std::min(text.find(',', begin), text.size());
    items.emplace_back(trimmed(text.substr(begin, end - begin)));
  }
  return items;
}

namespace {

/// The unit of one of its spellings, of any quantity; null: unknown.
const Unit* unit_of(std::string_view spelling) {
  const std::string text = lower(trimmed(spelling)), wanted = "|" + text + "|";
  if (text.empty() || text.find('|') != std::string::npos) return nullptr;
  for (const Unit& unit : kUnits) {
    if (unit.spellings.find(wanted) != std::string_view::npos) return &unit;
  }
  return nullptr;
}

std::string_view without_brackets(std::string_view text) {
  text = trimmed(text);
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}, {'<', '>'}}) {
    if (text.size() > 1 && text.front() == open && text.back() == close)
      return trimmed(text.substr(1, text.size() - 2));
  }
  return text;
}

bool has_any(std::string_view text, std::initializer_list<std::string_view> parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](std::string_view part) { return text.find(part) != std::string_view::npos; });
}

/// Without brackets or a mark, "temp_min" is a minimum and "x_h" a name; "time_min" and "time_h" are times.
const Unit* unmarked_unit_of(std::string_view name, std::string_view spelling) {
  const std::string text = lower(spelling);
  const bool may_be_name = text == "min" || text == "h" || text == "d" || text == "std" || text == "day";
  return may_be_name && !has_any(lower(name), {"time", "zeit", "elapsed", "stamp"}) ? nullptr : unit_of(text);
}

/// "Rate x1000 [deg/h]", "T / 0.1 °C": the values are not in the unit.
bool has_factor(std::string_view text) {
  return has_any(lower(text),
                 {"10^",   "10**", " x10", "(x10", "×10",  "*10", "·10", "10*", "10·", "10×",   "00*", "/10 ",
                  "/ 10 ", "/0.",  "/ 0.", " e-3", " e-6", "1e-", "1e+", "1e3", "1e6", "log10", "log("});
}

}  // namespace

bool is_unit_cell(std::string_view cell) {
  const std::string_view text = without_brackets(cell);
  if (text.empty() || unit_of(text) || text.size() < cell.size()) return true;
  constexpr std::array<std::string_view, 17> kOther = {"ts",  "rn",  "-", "%", "deg", "rad", "a",   "ma",  "pa",
                                                       "hpa", "bar", "g", "m", "hz",  "°",   "n/a", "none"};
  return std::find(kOther.begin(), kOther.end(), lower(text)) != kOther.end();
}

Header read_header(std::string_view text, std::string_view unit_text) {
  text = trimmed(text);
  Header header{std::string(text), std::string(text)};
  if (has_factor(text)) return header;
  if (!trimmed(unit_text).empty()) {
    header.unit = has_factor(unit_text) ? nullptr : unit_of(without_brackets(unit_text));
    header.stated = header.unit != nullptr;
    return header;
  }
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}}) {
    const std::size_t begin = text.rfind(open);
    if (begin == std::string_view::npos || begin == 0 || !text.ends_with(close)) continue;
    const Unit* unit = unit_of(text.substr(begin + 1, text.size() - begin - 2));
    if (!unit) continue;
    return {std::string(text), std::string(trimmed(text.substr(0, begin))), unit, true};
  }
  // "T / K", "rate, deg/h", "Temp degC"; one letter alone is a name.
  const std::size_t blank = text.rfind(' ');
  if (blank != std::string_view::npos) {
    std::string_view name = trimmed(text.substr(0, blank));
    const std::string_view spelling = without_brackets(text.substr(blank + 1));
    const bool marked = name.ends_with('/') || name.ends_with(',') || name.ends_with(" in");
    const Unit* unit = marked ? unit_of(spelling) : spelling.size() > 1 ? unmarked_unit_of(name, spelling) : nullptr;
    if (unit && marked) name = trimmed(name.substr(0, name.size() - (name.ends_with("in") ? 3 : 1)));
    if (unit) return {std::string(text), std::string(name), unit, true};
  }
  // "rate_x_dps", "Temp_degC": the longest ending that is a unit.
  for (std::size_t at = text.find('_'); at != std::string_view::npos; at = text.find('_', at + 1)) {
    const std::string_view ending = text.substr(at + 1);
    const Unit* unit = at > 0 ? unmarked_unit_of(text.substr(0, at), ending) : nullptr;
    if (unit) return {std::string(text), std::string(text.substr(0, at)), unit, false};
  }
  // "Hours", "secs": the name is a unit of time.
  const Unit* const unit = text.size() > 3 ? unit_of(text) : nullptr;
  if (unit && unit->quantity == "time") header.unit = unit;
  return header;
}

}  // namespace prism::tables
