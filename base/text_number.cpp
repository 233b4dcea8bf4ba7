// SPDX-License-Identifier: MIT
#include "base/text_number.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace prism {
namespace {

constexpr double kPowers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
constexpr double kFixedLimit = 9e8;
constexpr std::int64_t kYear0 = -62'167'219'200, kYear10000 = 253'402'300'800;  // seconds since 1970

// Characters of a number, last one first. std::to_chars takes three times as long for fixed decimals.
class Digits {
 public:
  void character(char c) { *--begin_ = c; }
  void whole(std::uint64_t value) {
    do {
      character(static_cast<char>('0' + value % 10));
      value /= 10;
    } while (value > 0);
  }
  // Copies all kNumberChars, which is two moves of known size; the bytes after the number are undefined.
  char* copy_to(char* at) const {
    std::memcpy(at, begin_, kNumberChars);
    return at + (text_ + kNumberChars - begin_);
  }

 private:
  char text_[2 * kNumberChars];
  char* begin_ = text_ + kNumberChars;
};

}  // namespace

char* put_integer(char* at, std::int64_t value) { return std::to_chars(at, at + kNumberChars, value).ptr; }

char* put_fixed(char* at, double value, int decimals) {
  if (!std::isfinite(value)) return at;
  if (std::fabs(value) > kFixedLimit) return std::ranges::copy(fmt::format("{}", value), at).out;
  // Adding 0.5 and truncating is llround without the call: exact below 2^52, above it as exact as the double.
  const double scaled = std::fabs(value) * kPowers[decimals] + 0.5;
  auto magnitude = static_cast<std::uint64_t>(scaled);
  Digits digits;
  const bool negative = value < 0 && magnitude > 0;
  for (int i = 0; i < decimals; ++i, magnitude /= 10) digits.character(static_cast<char>('0' + magnitude % 10));
  if (decimals > 0) digits.character('.');
  digits.whole(magnitude);
  if (negative) digits.character('-');
  return digits.copy_to(at);
}

void append_integer(std::string& text, std::int64_t value) {
  char digits[kNumberChars];
  text.append(digits, static_cast<std::size_t>(put_integer(digits, value) - digits));
}

void append_fixed(std::string& text, double value, int decimals) {
  char digits[kNumberChars];
  text.append(digits, static_cast<std::size_t>(put_fixed(digits, value, decimals) - digits));
}

std::string utc_text(std::int64_t second) {
  if (second < kYear0 || second >= kYear10000) return std::to_string(second);
  const std::chrono::sys_seconds time{std::chrono::seconds{second}};
  const auto midnight = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(midnight);
  const std::chrono::hh_mm_ss clock(time - midnight);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), clock.hours().count(),
                     clock.minutes().count(), clock.seconds().count());
}

std::string utc_nano_text(std::int64_t time_ns) {
  const std::int64_t rest_ns = (time_ns % 1'000'000'000 + 1'000'000'000) % 1'000'000'000;
  std::string text = utc_text((time_ns - rest_ns) / 1'000'000'000);
  if (text.back() == 'Z') text.pop_back();
  return text + fmt::format(".{:09}Z", rest_ns);
}

std::string utc_file_text(std::int64_t second) {
  if (second < kYear0 || second >= kYear10000) return std::to_string(second);
  std::string text;
  for (const char c : utc_text(second)) {
    if (c != '-' && c != ':') text += c;
  }
  return text;
}

std::optional<std::int64_t> parse_utc_file_text(std::string_view text) {
  constexpr std::string_view kForm = "00000000T000000Z";
  if (text.size() < kForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kForm[i] == '0' ? !digit : text[i] != kForm[i]) return std::nullopt;
  }
  const auto number = [&](std::size_t at, std::size_t size) {
    int value = 0;
    for (const char c : text.substr(at, size)) value = 10 * value + (c - '0');
    return value;
  };
  const std::chrono::year_month_day date(std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(4, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(6, 2))));
  if (!date.ok()) return std::nullopt;
  const std::int64_t midnight = std::chrono::sys_days(date).time_since_epoch().count() * std::int64_t{86'400};
  return midnight + 3600 * number(9, 2) + 60 * number(11, 2) + number(13, 2);
}

}  // namespace prism
