// SPDX-License-Identifier: MIT
// Numbers as text: against printf over many random numbers, at the limits and at ties; times against gmtime.
#include "base/text_number.hpp"

#include <gtest/gtest.h>

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <random>
#include <string>
#include <string_view>

#include "tests/support/blocks.hpp"

namespace prism {
namespace {

std::string fixed(double value, int decimals) {
  std::string text = "x";  // must be unchanged
  append_fixed(text, value, decimals);
  return text.substr(1);
}

std::string by_printf(double value, int decimals) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  if (std::strtod(text, nullptr) == 0 && text[0] == '-') return text + 1;  // printf keeps the sign of a zero
  return text;
}

// True if value · 10^decimals is so close to a half that the product in doubles may round differently, or if a double
// has no decimals (above 2^52).
bool near_tie(double value, int decimals) {
  const long double scaled = std::fabs(static_cast<long double>(value)) * std::pow(10.0L, decimals);
  return std::fabs(scaled - std::floor(scaled) - 0.5L) <= scaled * 1.2e-16L;
}

TEST(ParseNumber, TakesOnlyAFiniteNumberThatIsTheCompleteText) {
  EXPECT_EQ(parse_number<double>("-1.5e3"), -1500);
  EXPECT_EQ(parse_number<int>("-7"), -7);
  EXPECT_EQ(parse_number<std::uint8_t>("255"), 255);
  for (const char* text : {"", " 1", "1 ", "+1", "1,5", "0x1", "inf", "-nan", "1e999"})
    EXPECT_FALSE(parse_number<double>(text)) << text;
  for (const char* text : {"", "256", "-1", "1.0", "1 "}) EXPECT_FALSE(parse_number<std::uint8_t>(text)) << text;
}

// Many numbers in the middle of a line, as logs have them; each other one is damaged.
TEST(ParseFixed, ReadsEachNumberAsFromChars) {
  std::mt19937 random(3);
  int read = 0;
  for (int i = 0; i < 400'000; ++i) {
    const int decimals = 1 + static_cast<int>(random() % 8);
    const double number =
        std::uniform_real_distribution<>(-1, 1)(random) * std::pow(10.0, static_cast<int>(random() % 12));
    const std::size_t before = random() % 20;
    std::string line = std::string(before, "0123456789.-,x"[random() % 14]) + fixed(number, decimals);
    const bool damaged = i % 2 == 1;
    if (damaged) line[before + random() % (line.size() - before)] = static_cast<char>(random() % 256);
    if (damaged && i % 3 == 0) line.erase(before + random() % (line.size() - before), 1);
    const std::string_view text = std::string_view(line).substr(before);
    double value = 0;
    const bool good = parse_fixed(text, before, decimals, value);
    const std::size_t point = text.find('.'), whole = point - (text.starts_with('-') ? 1 : 0);
    EXPECT_EQ(is_fixed(text, before, decimals), good && whole <= 8) << text;
    EXPECT_FALSE(good && before + point < 8) << text << ": reads before its line";
    if (!damaged && std::fabs(number) < 9e8) {
      EXPECT_EQ(good, whole + static_cast<std::size_t>(decimals) <= 15 && before + point >= (whole > 8 ? 16 : 8))
          << text;
    }
    if (!good) continue;
    read += !damaged;
    EXPECT_EQ(value, parse_number<double>(text)) << text;
  }
  EXPECT_GT(read, 100'000);
}

TEST(ParseFixed, RejectsEachTextThatIsNotANumber) {
  double value = 0;
  for (const char* text : {"", "-", ".", "1.", ".500000", "-.500000", "1.50000", "1.5000000", "1,500000", "+1.500000",
                           "1.500000 ", "1.5e0000", "--1.500000", "1.-00000", "nan", "123456789.1234567"}) {
    const std::string line = "01234567890123456789" + std::string(text);
    EXPECT_FALSE(parse_fixed(std::string_view(line).substr(20), 20, 6, value)) << text;
    EXPECT_FALSE(is_fixed(std::string_view(line).substr(20), 20, 6)) << text;
  }
  const std::string_view line = "2026-11-23T09:11:00Z,-0.012345,1795425060.004";
  EXPECT_TRUE(parse_fixed(line.substr(21, 9), 21, 6, value));
  EXPECT_EQ(value, -0.012345);
  EXPECT_TRUE(parse_fixed(line.substr(31), 31, 3, value));
  EXPECT_EQ(value, 1795425060.004);
  const std::string_view longest = "0123456789012345,87654321.1234567,0";  // 15 digits, and one more
  EXPECT_TRUE(parse_fixed(longest.substr(17, 16), 17, 7, value));
  EXPECT_EQ(value, 87654321.1234567);
  EXPECT_TRUE(is_fixed(longest.substr(17, 16), 17, 7));
  const std::string more = "0123456789012345,87654321.12345678";
  EXPECT_FALSE(parse_fixed(std::string_view(more).substr(17), 17, 8, value));
  EXPECT_FALSE(is_fixed(std::string_view(more).substr(17), 17, 8));
}

TEST(AppendFixed, MatchesPrintf) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  int ties = 0;
  for (int i = 0; i < 400'000; ++i) {
    const int decimals = static_cast<int>(random() % 10);
    const double value = mantissa(random) * std::pow(10.0, static_cast<double>(random() % 9));
    if (near_tie(value, decimals)) {
      ++ties;
      const double error = std::fabs(std::strtod(fixed(value, decimals).c_str(), nullptr) - value);
      ASSERT_LE(error, 0.5 * std::pow(10, -decimals) + 4e-16 * std::fabs(value))
          << value;  // a half and two last digits
      continue;
    }
    ASSERT_EQ(fixed(value, decimals), by_printf(value, decimals)) << decimals;
  }
  EXPECT_LT(ties, 40'000);
}

TEST(AppendFixed, RoundsHalvesAwayFromZeroCarriesAndPads) {
  for (const test::Block& row : test::blocks("base/fixed_numbers.txt", 3))
    EXPECT_EQ(fixed(std::stod(row[0]), std::stoi(row[1])), row[2]) << row.where;
}

TEST(AppendFixed, WritesShortestDigitsOutsideTheLimitAndNothingForANonFiniteNumber) {
  for (const double value : {900000000.1, -900000000.1, 1e17, -1e300, std::numeric_limits<double>::max()})
    EXPECT_EQ(std::strtod(fixed(value, 6).c_str(), nullptr), value) << fixed(value, 6);
  for (const double value : {std::nan(""), HUGE_VAL, -HUGE_VAL}) EXPECT_EQ(fixed(value, 6), "");
}

TEST(AppendInteger, WritesEveryInteger) {
  std::mt19937_64 random(19);
  std::vector<std::int64_t> values = {
      0, 1, -1, 9, 10, -10, std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()};
  for (int i = 0; i < 10'000; ++i) values.push_back(static_cast<std::int64_t>(random()) >> (random() % 64));
  for (const std::int64_t value : values) {
    std::string text;
    append_integer(text, value);
    ASSERT_EQ(text, std::to_string(value));
  }
}

std::string by_gmtime(std::int64_t second) {
  const std::time_t time = second;
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02dZ", parts.tm_year + 1900, parts.tm_mon + 1,
                parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec);
  return text;
}

constexpr std::int64_t kYear0 = -62'167'219'200;      // 0000-01-01T00:00:00Z
constexpr std::int64_t kYear10000 = 253'402'300'800;  // 10000-01-01T00:00:00Z

TEST(UtcText, MatchesGmtime) {
  std::mt19937_64 random(23);
  std::uniform_int_distribution<std::int64_t> any(kYear0, kYear10000 - 1);
  for (int i = 0; i < 100'000; ++i) {
    const std::int64_t second = any(random);
    ASSERT_EQ(utc_text(second), by_gmtime(second)) << second;
  }
  for (std::int64_t day = -1000 * 365; day < 1000 * 365; ++day) {  // both sides of every midnight of two thousand years
    ASSERT_EQ(utc_text(day * 86400), by_gmtime(day * 86400));
    ASSERT_EQ(utc_text(day * 86400 - 1), by_gmtime(day * 86400 - 1));
  }
}

}  // namespace
}  // namespace prism
