// SPDX-License-Identifier: MIT
#include "compensation/text_number.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace prism {
namespace {

constexpr double kPowers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
constexpr double kFixedLimit = 9e8;
constexpr std::int64_t kYear0 = -62'167'219'200, kYear10000 = 253'402'300'800;  // seconds since 1970

struct CivilTime {
  std::int64_t year;
  int month, day, hour, minute, second;
};

// Days → civil date after Hinnant (2013), "chrono-compatible low-level date algorithms"; std::chrono in g++ 12 formats
// none.
CivilTime civil_time(std::int64_t seconds) {
  const std::int64_t days = (seconds >= 0 ? seconds : seconds - 86399) / 86400;
  const int of_day = static_cast<int>(seconds - days * 86400);
  const std::int64_t z = days + 719468;
  const std::int64_t era = (z >= 0 ? z : z - 146096) / 146097;
  const std::int64_t doe = z - era * 146097;
  const std::int64_t yoe = (doe - doe / 1460 + doe / 36524 - doe / 146096) / 365;
  const std::int64_t doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
  const std::int64_t mp = (5 * doy + 2) / 153;
  const int month = static_cast<int>(mp < 10 ? mp + 3 : mp - 9);
  return {yoe + era * 400 + (month <= 2),
          month,
          static_cast<int>(doy - (153 * mp + 2) / 5 + 1),
          of_day / 3600,
          of_day / 60 % 60,
          of_day % 60};
}

// A number's characters, the last one first. No table of digits and no call: a live frame finds both cold.
class Digits {
 public:
  void character(char c) { *--begin_ = c; }
  void whole(std::uint64_t value) {
    do {
      character(static_cast<char>('0' + value % 10));
      value /= 10;
    } while (value > 0);
  }
  // All kNumberChars are copied, which is two moves of known size; what stands behind the number means nothing.
  char* copy_to(char* at) const {
    std::memcpy(at, begin_, kNumberChars);
    return at + (text_ + kNumberChars - begin_);
  }

 private:
  char text_[2 * kNumberChars];
  char* begin_ = text_ + kNumberChars;
};

}  // namespace

char* put_integer(char* at, std::int64_t value) {
  Digits digits;
  digits.whole(value < 0 ? std::uint64_t{0} - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value));
  if (value < 0) digits.character('-');
  return digits.copy_to(at);
}

char* put_fixed(char* at, double value, int decimals) {
  if (!std::isfinite(value)) return at;
  if (std::fabs(value) > kFixedLimit) return fmt::format_to(at, "{}", value);
  // Truncating what was moved by a half is llround without the call: exact below 2^52, above it as exact as the double.
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
  const CivilTime t = civil_time(second);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", t.year, t.month, t.day, t.hour, t.minute, t.second);
}

std::string utc_file_text(std::int64_t second) {
  if (second < kYear0 || second >= kYear10000) return std::to_string(second);
  std::string text;
  for (const char c : utc_text(second)) {
    if (c != '-' && c != ':') text += c;
  }
  return text;
}

}  // namespace prism
