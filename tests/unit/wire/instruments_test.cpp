// SPDX-License-Identifier: MIT
// Instruments without a gyro: descriptions, printed numbers, configured columns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/wire/description/printed_number.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using testing::ElementsAre;

GyroChoice columns(std::vector<TextColumn> of) {
  GyroChoice choice;
  choice.sensors = true;
  choice.text.columns = std::move(of);
  return choice;
}

/// Values of each sensor by lines; 1e9 is an unknown value.
std::vector<std::vector<double>> values(const GyroChoice& choice, const std::string& lines) {
  const auto description = test::shipped("ascii-columns", choice);
  std::vector<std::vector<double>> found;
  for (const DecodedMessage& reading : test::decode(description, {lines.begin(), lines.end()})) {
    std::vector<double>& row = found.emplace_back();
    for (std::size_t i = 0; i < description->sensors.size(); ++i)
      row.push_back(std::isnan(reading.sensors[i]) ? 1e9 : reading.sensors[i]);
  }
  return found;
}

TEST(PrintedNumber, AcceptsOnlyNumbers) {
  EXPECT_EQ(parse_decimal("23.5", '.'), 23.5);
  EXPECT_EQ(parse_decimal("  +23.5 ", '.'), 23.5);
  EXPECT_EQ(parse_decimal("-0,25", ','), -0.25);
  EXPECT_EQ(parse_decimal("00000235", '.'), 235);
  for (const char* wrong : {"", " ", "-", "23,5", "23.5C", "nan", "inf", "+-5", "2 3", "0x10"})
    EXPECT_TRUE(std::isnan(parse_decimal(wrong, '.'))) << wrong;
  EXPECT_TRUE(std::isnan(parse_decimal("23.5", ','))) << "a thousand's mark, perhaps";
}

TEST(PrintedNumber, AcceptsExponents) {
  EXPECT_EQ(parse_decimal("1.25E-03", '.'), 1.25e-3);
  EXPECT_EQ(parse_decimal("1e3", '.'), 1000);
  EXPECT_EQ(parse_decimal(" +1.5E+02 ", '.'), 150);
  EXPECT_EQ(parse_decimal("-1,5e2", ','), -150);
  for (const char* wrong : {"1e", "1E+", "e3", "1.25E-03C", "1e400", "1e3.5", "1e 3"})
    EXPECT_TRUE(std::isnan(parse_decimal(wrong, '.'))) << wrong;
}

TEST(Instruments, ReadColumnsWithExponents) {
  EXPECT_THAT(values(columns({{{"p", "Pa"}, 0}}), "\n1.25E-03\n1e3\n+1.5E+02\n"),
              ElementsAre(ElementsAre(1.25e-3), ElementsAre(1000), ElementsAre(150)));
}

TEST(Instruments, ReadTheConfiguredColumns) {
  const auto choice = columns({{{"inlet", "degC"}, 1}, {{"outlet", "degC"}, 3, -40, 120}});
  EXPECT_THAT(
      values(choice, "\n1;20.5;x;21.25\r\n2;20.6;x;150\r\n3;Err.1;x;21.5\r\n4;20.75\n"),
      ElementsAre(ElementsAre(20.5, 21.25), ElementsAre(20.6, 1e9), ElementsAre(1e9, 21.5), ElementsAre(20.75, 21.5)))
      << "a column that is not there is held for a line, as a sensor that another frame carries";
}

TEST(Instruments, CollapseBlanksAndAcceptADecimalComma) {
  auto choice = columns({{{"t", "degC"}, 1}});
  choice.text.separators = " ";
  EXPECT_THAT(values(choice, "\nT1    23.5 C\nT1 -4.25  C\r\n"), ElementsAre(ElementsAre(23.5), ElementsAre(-4.25)));
  choice.text.separators = ";";
  choice.text.decimal_comma = true;
  choice.text.ends_with_cr = true;
  EXPECT_THAT(values(choice, "\r1;23,5\r2;-4,25\r"), ElementsAre(ElementsAre(23.5), ElementsAre(-4.25)));
}

// Published test lines of a thermometer that prints only its value.
TEST(Instruments, ReadPublishedLinesOfAThermometer) {
  EXPECT_THAT(values(columns({{{"t", "degC"}, 0}}), "\n121.1\r\n  1.5\r\n-11.2\r\nErr.1\r\n"),
              ElementsAre(ElementsAre(121.1), ElementsAre(1.5), ElementsAre(-11.2), ElementsAre(1e9)));
}

TEST(Instruments, IgnoreAPartOfALine) {
  EXPECT_THAT(values(columns({{{"t", "degC"}, 0}}), "3.5\n24.5\n25.5\n"),
              ElementsAre(ElementsAre(24.5), ElementsAre(25.5)));
}

TEST(Instruments, KeepEachChannelUntilItsNextValue) {
  GyroChoice choice;
  choice.sensors = true;
  const auto logger = test::shipped("lutron-btm4208sd", choice);
  ASSERT_EQ(logger->sensors.size(), 12u);
  EXPECT_FALSE(logger->carries_gyro());
  const auto frame = [](char channel, char sign, const char* digits) {
    return std::string("\x02") + "4" + channel + "01" + sign + "1" + digits + "\r";
  };
  const std::string bytes = frame('1', '0', "00001234") + frame('2', '1', "00000235") + frame('C', '0', "00000001") +
                            frame('1', '0', "00001235") + frame('1', '0', "00001236");
  const auto readings = test::decode(logger, {bytes.begin(), bytes.end()});
  ASSERT_EQ(readings.size(), 5u);
  const DecodedMessage& last = readings.back();
  EXPECT_DOUBLE_EQ(last.sensors[0], 123.6);
  EXPECT_DOUBLE_EQ(last.sensors[1], -23.5);
  EXPECT_TRUE(std::isnan(last.sensors[2]));
  EXPECT_DOUBLE_EQ(last.sensors[11], 0.1);
}

TEST(Instruments, IgnoreUnconfiguredColumns) {
  FrameEncoder encoder(test::shipped("ascii-columns", {}));
  std::vector<std::uint8_t> bytes;
  encoder.encode({.rate_deg_per_h = {10}, .interval_s = 1}, bytes);
  EXPECT_TRUE(bytes.empty());
}

TEST(Instruments, ReportErrorsInOneLine) {
  const auto refusal = [](const std::string& text, const GyroChoice& choice = {}) {
    const auto parsed = parse_frame_description(text, "f.json", choice);
    return parsed ? std::string("accepted") : parsed.error().text();
  };
  const std::string text = test::read_file(test::frames_dir() / "ascii-columns.json");
  std::string bare = text, gyros = text;
  bare.replace(bare.find("\"sensors\": {},"), 14, "");
  EXPECT_EQ(refusal(bare), "f.json: \"gyro\" is missing");
  gyros.replace(gyros.find("\"sensors\": {},"), 14, "\"sensors\": {}, \"status\": {\"field\": \"first\"},");
  EXPECT_EQ(refusal(gyros), "f.json:/status: only valid with \"gyro\"; use \"sensors\" instead");
  EXPECT_EQ(refusal(test::read_file(test::frames_dir() / "trplg.json"), columns({{{"t", "degC"}, 0}})),
            "f.json: does not describe text lines without a gyro, as required by \"columns\"");
  auto within = columns({{{"t", "degC"}, 0}});
  within.text.separators = "semicolon";
  EXPECT_THAT(refusal(text, within), testing::HasSubstr("expected the characters between two columns"));
  within.text.separators = ".;";
  EXPECT_EQ(refusal(text, within), "f.json:/kinds/0/text/separators: contains '.', which can occur in numbers");
}

}  // namespace
}  // namespace prism::wire
