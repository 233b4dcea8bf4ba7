// SPDX-License-Identifier: MIT
#include "tools/prismcal/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "base/text_number.hpp"

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
  return std::ranges::any_of(parts, [&](std::string_view part) { return text.find(part) != std::string_view::npos; });
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
  return std::ranges::find(kOther, lower(text)) != kOther.end();
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

namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Takes the numbers of a form, whose zeros are digits, from the front of a text. Returns false, without
/// a change, if the text does not begin so.
bool take(std::string_view& text, std::string_view form, std::initializer_list<int*> numbers) {
  const auto fits = [](char at, char c) { return at == '0' ? c >= '0' && c <= '9' : at == c; };
  if (text.size() < form.size() || !std::equal(form.begin(), form.end(), text.begin(), fits)) return false;
  const auto* number = numbers.begin();
  for (std::size_t i = form.find('0'); i < form.size(); ++i) {
    if (form[i] != '0')
      ++number;
    else
      **number = 10 * **number + (text[i] - '0');
  }
  text.remove_prefix(form.size());
  return true;
}

}  // namespace

std::optional<IsoTime> iso_time(std::string_view text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, zone_h = 0, zone_min = 0, digit = 0;
  if (!take(text, "0000-00-00", {&year, &month, &day}) || year < 1900 || year > 2150) return std::nullopt;
  const auto date = std::chrono::year(year) / month / day;
  if (!date.ok()) return std::nullopt;
  IsoTime time{std::chrono::sys_days(date).time_since_epoch().count() * 86400LL * kSecond_ns};
  if (text.empty()) return time;
  time.has_clock = take(text, "T00:00", {&hour, &minute}) || take(text, " 00:00", {&hour, &minute});
  const bool has_second = take(text, ":00", {&second});  // 60, a leap second, is the second after it
  if (!time.has_clock || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  time.ns += ((hour * 60 + minute) * 60 + second) * kSecond_ns;
  if (has_second && (text.starts_with('.') || text.starts_with(','))) {
    text.remove_prefix(1);  // digits after the ninth are dropped
    for (auto unit = kSecond_ns / 10; take(text, "0", {&digit}); unit /= 10) time.ns += unit * std::exchange(digit, 0);
  }
  if (text.starts_with(' ')) text.remove_prefix(1);
  if (text.empty()) return time;
  const int sign = text.starts_with('-') ? -1 : 1;
  const bool is_utc = text == "Z", has_offset = take(text, sign < 0 ? "-00" : "+00", {&zone_h});
  if (has_offset && !take(text, ":00", {&zone_min})) take(text, "00", {&zone_min});
  if ((!is_utc && !(has_offset && text.empty())) || zone_h > 14 || zone_min > 59) return std::nullopt;
  return IsoTime{time.ns - sign * (zone_h * 60 + zone_min) * 60 * kSecond_ns, true, true};
}

std::string TimeFormat::text() const {
  if (unit) return fmt::format("a number of {}", unit->name);
  return has_zone ? "ISO 8601" : "ISO 8601, no zone: taken for UTC";
}

std::optional<std::int64_t> TimeFormat::of_number(std::string_view cell, double number) const {
  constexpr double kMost_s = 4.5e9;  // the difference of two times is 64 bits of ns
  number = number * scale + offset;
  const double seconds = number * unit->factor;
  if (!(std::fabs(seconds) <= kMost_s)) return std::nullopt;
  // All digits of an integer; a double has 256 ns in 2024.
  const auto integer = scale == 1 && offset == 0 ? parse_number<std::int64_t>(cell) : std::nullopt;
  if (integer) return *integer * std::llround(unit->factor * 1e9);
  if (unit->factor == 1e-9) return std::llround(number);
  if (std::fabs(seconds) < 1e7) return std::llround(seconds * 1e9);
  const double whole = std::floor(seconds);
  return static_cast<std::int64_t>(whole) * kSecond_ns + std::llround((seconds - whole) * 1e9);
}

std::string time_text(std::int64_t time_ns, bool is_date) {
  if (!is_date) return fmt::format("{:.9g} s", static_cast<double>(time_ns) / 1e9);
  std::string text = utc_nano_text(time_ns);
  text.pop_back();  // Z
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text + "Z";
}

}  // namespace prism::tables
