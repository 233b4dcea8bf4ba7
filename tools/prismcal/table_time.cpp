// SPDX-License-Identifier: MIT
#include "tools/prismcal/table_time.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "base/text_number.hpp"

namespace prism::tables {
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
