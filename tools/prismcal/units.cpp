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

/// Takes parts from the front of a text.
struct Text {
  std::string_view rest;

  bool skip(std::string_view any_of) {
    if (rest.empty() || any_of.find(rest.front()) == std::string_view::npos) return false;
    rest.remove_prefix(1);
    return true;
  }
  /// A number of exactly `digits` digits up to `most`; -1: none.
  int number(std::size_t digits, int most) {
    const auto value = rest.size() < digits ? std::nullopt : parse_number<unsigned>(rest.substr(0, digits));
    if (!value || static_cast<int>(*value) > most) return -1;
    rest.remove_prefix(digits);
    return static_cast<int>(*value);
  }
  /// Digits as a fraction of a second; those after the ninth are dropped.
  std::int64_t fraction_ns() {
    std::int64_t value = 0, unit = kSecond_ns;
    for (; !rest.empty() && rest.front() >= '0' && rest.front() <= '9'; rest.remove_prefix(1)) {
      if (unit > 1) value += (rest.front() - '0') * (unit /= 10);
    }
    return value;
  }
};

/// Reads hh:mm[:ss[.f]]; nullopt for another text.
std::optional<std::int64_t> time_of_day_ns(Text& text) {
  const int hours = text.number(2, 23), minutes = text.skip(":") ? text.number(2, 59) : -1;
  if (hours < 0 || minutes < 0) return std::nullopt;
  std::int64_t ns = (hours * 60 + minutes) * 60 * kSecond_ns;
  if (!text.skip(":")) return ns;
  const int seconds = text.number(2, 60);  // a leap second is the second after it
  if (seconds < 0) return std::nullopt;
  ns += seconds * kSecond_ns;
  return text.skip(".,") ? ns + text.fraction_ns() : ns;
}

/// Reads Z, +hh, +hhmm or +hh:mm.
std::optional<std::int64_t> zone_s(Text& text) {
  if (text.skip("Z")) return 0;
  const int sign = text.skip("+") ? 1 : text.skip("-") ? -1 : 0;
  const int hours = text.number(2, 14);
  const bool has_minutes = text.skip(":") || !text.rest.empty();
  const int minutes = has_minutes ? text.number(2, 59) : 0;
  if (sign == 0 || hours < 0 || minutes < 0) return std::nullopt;
  return sign * (hours * 60 + minutes) * 60;
}

}  // namespace

std::optional<IsoTime> iso_time(std::string_view cell) {
  Text text{cell};
  const int year = text.number(4, 2150), month = text.skip("-") ? text.number(2, 12) : -1,
            day = text.skip("-") ? text.number(2, 31) : -1;
  if (year < 1900 || month < 0 || day < 0) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok()) return std::nullopt;
  IsoTime time{std::chrono::sys_days(date).time_since_epoch().count() * 86400LL * kSecond_ns};
  if (text.rest.empty()) return time;
  const auto of_day = text.skip("T ") ? time_of_day_ns(text) : std::nullopt;
  if (!of_day) return std::nullopt;
  time.ns += *of_day;
  time.has_clock = true;
  text.skip(" ");
  if (text.rest.empty()) return time;
  const auto zone = zone_s(text);
  if (!zone || !text.rest.empty()) return std::nullopt;
  return IsoTime{time.ns - *zone * kSecond_ns, true, true};
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
