// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/date_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <string>

namespace prism::tables {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Takes parts from the front of a text.
class Text {
 public:
  explicit Text(std::string_view text) : text_(text) {}
  bool empty() const { return text_.empty(); }
  bool skip(char c) {
    if (!text_.starts_with(c)) return false;
    text_.remove_prefix(1);
    return true;
  }
  void blanks() {
    while (skip(' ')) continue;
  }
  char front() const { return text_.empty() ? '\0' : text_.front(); }
  /// A number of digits; `digits` is their number, 0 without a number.
  int number(std::size_t& digits) {
    int value = 0;
    const auto [end, error] =
        std::from_chars(text_.data(), text_.data() + std::min<std::size_t>(text_.size(), 9), value);
    digits =
        error == std::errc() && front() >= '0' && front() <= '9' ? static_cast<std::size_t>(end - text_.data()) : 0;
    text_.remove_prefix(digits);
    return value;
  }
  /// Up to nine digits as a fraction of a second; more digits are dropped.
  std::int64_t fraction_ns() {
    std::int64_t value = 0, unit = kSecond_ns;
    for (; front() >= '0' && front() <= '9'; text_.remove_prefix(1)) {
      if (unit > 1) value += (front() - '0') * (unit /= 10);
    }
    return value;
  }
  std::string word() {
    std::string letters;
    for (; (front() | 32) >= 'a' && (front() | 32) <= 'z'; text_.remove_prefix(1))
      letters.push_back(static_cast<char>(front() | 32));
    return letters;
  }
  Text copy() const { return *this; }

 private:
  std::string_view text_;
};

int month_of(const std::string& word) {
  constexpr std::array<std::string_view, 12> kEnglish = {"jan", "feb", "mar", "apr", "may", "jun",
                                                         "jul", "aug", "sep", "oct", "nov", "dec"};
  constexpr std::array<std::string_view, 12> kOther = {"", "", "mrz", "", "mai", "", "", "", "", "okt", "", "dez"};
  for (std::size_t i = 0; i < 12; ++i) {
    if (word.starts_with(kEnglish[i]) || (!kOther[i].empty() && word == kOther[i])) return static_cast<int>(i) + 1;
  }
  return 0;
}

bool read_date(Text& text, DateText& date) {
  std::size_t digits1 = 0, digits2 = 0, digits3 = 0;
  const int a = text.number(digits1);
  const char separator = text.front();
  if (digits1 == 0 || (separator != '-' && separator != '/' && separator != '.') || !text.skip(separator)) return false;
  const std::string word = text.word();
  const int b = word.empty() ? text.number(digits2) : month_of(word);
  if (b < 1 || !text.skip(separator)) return false;
  const int c = text.number(digits3);
  if (digits3 == 0) return false;
  if (digits1 == 4 && digits3 <= 2) {
    date.order = DateOrder::kYearFirst;
    date.year = a, date.first = b, date.second = c;
    return c >= 1 && c <= 31 && b <= 12;
  }
  if (digits3 != 4 || digits1 > 2 || a < 1 || a > 31 || b > 31) return false;
  date.year = c, date.first = a, date.second = b;
  const bool day_first = separator == '.' || !word.empty() || a > 12;
  date.order = day_first ? DateOrder::kDayFirst : b > 12 ? DateOrder::kMonthFirst : DateOrder::kEither;
  return !day_first || b <= 12;
}

bool read_clock(Text& text, DateText& date) {
  std::size_t digits = 0, minutes_digits = 0, seconds_digits = 2;
  int hours = text.number(digits);
  if (digits == 0 || digits > 2 || hours > 24 || !text.skip(':')) return false;
  const int minutes = text.number(minutes_digits);
  if (minutes_digits != 2 || minutes > 59) return false;
  int seconds = 0;
  std::int64_t fraction_ns = 0;
  date.has_seconds = text.skip(':');
  if (date.has_seconds) {
    seconds = text.number(seconds_digits);
    if (seconds_digits != 2 || seconds > 60) return false;
    if (text.skip('.') || text.skip(',')) fraction_ns = text.fraction_ns();
  }
  text.blanks();
  Text ahead = text.copy();
  const std::string half = ahead.word();
  if (half == "am" || half == "pm") {
    if (hours < 1 || hours > 12) return false;
    hours = hours % 12 + (half == "pm" ? 12 : 0);
    text = ahead;
  }
  date.has_time = true;
  date.time_of_day_ns = ((hours * 60 + minutes) * 60LL + seconds) * kSecond_ns + fraction_ns;
  return true;
}

bool read_zone(Text& text, DateText& date) {
  text.blanks();
  if (text.empty()) return true;
  Text ahead = text.copy();
  const std::string word = ahead.word();
  date.has_zone = true;
  if (word == "z" || word == "utc" || word == "gmt") {
    text = ahead;
    return text.empty();
  }
  const int sign = text.skip('+') ? 1 : text.skip('-') ? -1 : 0;
  std::size_t digits = 0, minutes_digits = 0;
  int hours = text.number(digits), minutes = 0;
  if (sign == 0 || (digits != 2 && digits != 4)) return false;
  if (digits == 4) {
    minutes = hours % 100;
    hours /= 100;
  } else if (text.skip(':')) {
    minutes = text.number(minutes_digits);
  }
  date.zone_s = sign * (hours * 60LL + minutes) * 60;
  return text.empty() && hours <= 14 && minutes <= 59;
}

}  // namespace

std::optional<DateText> date_in(std::string_view cell) {
  // "[2024-03-01 12:00:05.250]" of a terminal program, which blanks may divide.
  if (cell.starts_with('[')) cell.remove_prefix(1);
  if (cell.ends_with(']')) cell.remove_suffix(1);
  if (cell.size() < 4 || cell.size() > 48 || cell.front() < '0' || cell.front() > '9') return std::nullopt;
  DateText date;
  Text text(cell);
  Text clock = text.copy();
  if (read_clock(clock, date)) {
    if (!read_zone(clock, date)) return std::nullopt;
    return date;
  }
  date = {};
  if (!read_date(text, date)) return std::nullopt;
  if (text.empty()) return date;
  if (!text.skip('T') && !text.skip('t') && text.front() != ' ' && text.front() != ',') return std::nullopt;
  text.skip(',');
  text.blanks();
  if (!read_clock(text, date) || !read_zone(text, date)) return std::nullopt;
  return date;
}

std::optional<std::int64_t> nanoseconds_of(const DateText& cell, DateOrder order) {
  if (cell.order == DateOrder::kNone) return cell.time_of_day_ns - cell.zone_s * kSecond_ns;
  if (cell.order == DateOrder::kEither && order != DateOrder::kDayFirst && order != DateOrder::kMonthFirst)
    return std::nullopt;
  const bool year_first = cell.order == DateOrder::kYearFirst;
  const bool day_first =
      cell.order == DateOrder::kEither ? order == DateOrder::kDayFirst : cell.order == DateOrder::kDayFirst;
  if (!year_first && cell.order != DateOrder::kEither && (order == DateOrder::kDayFirst) != day_first &&
      (order == DateOrder::kDayFirst || order == DateOrder::kMonthFirst))
    return std::nullopt;  // 13/04/2024 where the month comes first
  const int month = year_first || !day_first ? cell.first : cell.second;
  const int day = year_first || !day_first ? cell.second : cell.first;
  const std::chrono::year_month_day ymd{std::chrono::year(cell.year), std::chrono::month(static_cast<unsigned>(month)),
                                        std::chrono::day(static_cast<unsigned>(day))};
  if (!ymd.ok() || cell.year < 1700 || cell.year > 2250) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(ymd).time_since_epoch().count();
  return (days * 86400 - cell.zone_s) * kSecond_ns + cell.time_of_day_ns;
}

}  // namespace prism::tables
