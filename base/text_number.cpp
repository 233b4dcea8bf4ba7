// SPDX-License-Identifier: MIT
#include "base/text_number.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ctime>
#include <system_error>

namespace prism {
namespace {

constexpr double kPowers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
constexpr std::uint64_t kIntegerPowers[] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000};
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

/// The `count` (1 to 8) digits that end at `end`, each in a byte, the last one in the highest; the bytes before them
/// are 0. Bytes that are not digits are above 9. The eight bytes before `end` must be readable.
inline std::uint64_t digits_before(const char* end, std::size_t count) {
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, end - 8, sizeof bytes);
  if constexpr (std::endian::native == std::endian::big) bytes = __builtin_bswap64(bytes);
  return (bytes ^ 0x3030303030303030) & (~std::uint64_t{0} << (64 - 8 * count));
}

/// The highest bit of a byte is set if it is above 9, or if one below it is.
inline std::uint64_t above_9(std::uint64_t digits) {
  return ((digits + 0x7676767676767676) | digits) & 0x8080808080808080;
}

/// The number of eight digits. Neighbours are joined: four numbers of two digits, two of four, one of eight.
inline std::uint64_t number_of(std::uint64_t digits) {
  constexpr std::uint64_t kOf2 = 0x00ff00ff00ff00ff, kOf4 = 0x0000ffff0000ffff, kOf8 = 0xffffffff;
  const std::uint64_t pairs = (digits & kOf2) * 10 + (digits >> 8 & kOf2);
  const std::uint64_t fours = (pairs & kOf4) * 100 + (pairs >> 16 & kOf4);
  return (fours & kOf8) * 10000 + (fours >> 32);
}

/// The parts of "-123.456000".
struct FixedParts {
  const char *point = nullptr, *end = nullptr;
  std::size_t whole_digits = 0, before_point = 0;  ///< before_point: bytes that may be read

  /// Returns false if the text is too short or has no point at its place.
  bool find(std::string_view text, std::size_t before, std::size_t places) {
    const std::size_t sign = text.starts_with('-') ? 1 : 0;
    if (text.size() < sign + places + 2) return false;
    whole_digits = text.size() - sign - places - 1;
    before_point = before + text.size() - places - 1;
    end = text.data() + text.size();
    point = end - places - 1;
    return *point == '.' && before_point >= 8;
  }
};

}  // namespace

bool parse_fixed(std::string_view text, std::size_t before, int decimals, double& value) {
  const auto places = static_cast<std::size_t>(decimals);
  FixedParts parts;
  if (!parts.find(text, before, places) || parts.whole_digits + places > 15) return false;
  const std::uint64_t fraction = digits_before(parts.end, places);
  const std::uint64_t whole = digits_before(parts.point, std::min<std::size_t>(parts.whole_digits, 8));
  if (above_9(fraction) | above_9(whole)) return false;
  std::uint64_t number = number_of(whole);
  if (parts.whole_digits > 8) {
    if (parts.before_point < 16) return false;
    const std::uint64_t first = digits_before(parts.point - 8, parts.whole_digits - 8);
    if (above_9(first)) return false;
    number += number_of(first) * 100'000'000;
  }
  number = number * kIntegerPowers[decimals] + number_of(fraction);
  // The quotient of two integers that doubles hold exactly is rounded once, as from_chars() does.
  const double magnitude = static_cast<double>(number) / kPowers[decimals];
  value = text.front() == '-' ? -magnitude : magnitude;
  return true;
}

bool is_fixed(std::string_view text, std::size_t before, int decimals) {
  const auto places = static_cast<std::size_t>(decimals);
  FixedParts parts;
  if (!parts.find(text, before, places) || parts.whole_digits > 8 || parts.whole_digits + places > 15) return false;
  return (above_9(digits_before(parts.end, places)) | above_9(digits_before(parts.point, parts.whole_digits))) == 0;
}

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
  return fmt::format("{:%FT%TZ}", fmt::gmtime(second));
}

std::string utc_nano_text(std::int64_t time_ns) {
  const std::int64_t rest_ns = (time_ns % 1'000'000'000 + 1'000'000'000) % 1'000'000'000;
  std::string text = utc_text((time_ns - rest_ns) / 1'000'000'000);
  text.pop_back();  // Z: a number of nanoseconds is within the years 1677 to 2262
  return text + fmt::format(".{:09}Z", rest_ns);
}

std::string utc_file_text(std::int64_t second) {
  if (second < kYear0 || second >= kYear10000) return std::to_string(second);
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(second));
}

std::optional<std::int64_t> parse_utc_file_text(std::string_view text) {
  const std::string stamp(text.substr(0, sizeof "20261121T091100Z" - 1));
  std::tm time{};
  if (::strptime(stamp.c_str(), "%Y%m%dT%H%M%SZ", &time) == nullptr) return std::nullopt;
  const std::int64_t second = ::timegm(&time);
  return utc_file_text(second) == stamp ? std::optional(second) : std::nullopt;  // strptime takes other forms, too
}

std::vector<std::uint8_t> hex_bytes(std::string_view text) {
  std::vector<std::uint8_t> result;
  while (!text.empty()) {
    if (text.front() == ' ') {
      text.remove_prefix(1);
      continue;
    }
    std::uint8_t byte = 0;
    const char* last = text.data() + std::min<std::size_t>(text.size(), 2);
    const auto [end, error] = std::from_chars(text.data(), last, byte, 16);
    if (error != std::errc{} || end != text.data() + 2) return {};
    result.push_back(byte);
    text.remove_prefix(2);
  }
  return result;
}

}  // namespace prism
