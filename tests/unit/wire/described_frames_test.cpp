// SPDX-License-Identifier: MIT
// Descriptions for tests, in tests/replay/frames/described: exponents, hexadecimal digits, text checks without a mark.
// damage_test.cpp runs its properties on them too.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/clock.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes characters(const std::string& text) { return {text.begin(), text.end()}; }

std::string error_of(const std::string& text) {
  const auto parsed = parse_frame_description(text, "t.json");
  if (!parsed) return parsed.error().text();
  const auto run = run_test_vectors(**parsed);
  return run ? "good" : run.error().text();
}

/// One message type "k" with the given members, and a vector.
std::string one_type(const std::string& members, const std::string& vector) {
  return R"({"format": "prism-frames", "version": 1, "name": "x", "line": {"baud": 115200}, "rate_hz": 1,
    "kinds": [{"name": "k", )" +
         members + R"(}], "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "r"}}, "vectors": [)" + vector +
         "]}";
}

class Described : public testing::TestWithParam<std::string> {};

TEST_P(Described, DecodesItsVectors) {
  const auto description = test::shipped(GetParam());
  EXPECT_FALSE(description->test_vectors.empty());
  const auto run = run_test_vectors(*description);
  EXPECT_TRUE(run) << run.error().text();
}

TEST_P(Described, IsRecognisedByTheSniffer) {
  std::vector<FrameDescriptionPtr> all;
  for (const std::string& name : test::shipped_gyros()) all.push_back(test::shipped(name));
  const auto truth = test::shipped(GetParam());
  all.push_back(truth);
  FrameEncoder encoder(truth);
  Bytes bytes;
  for (int i = 0; i < 200; ++i)
    encoder.encode({.rate_deg_per_h = {10.0 + i}, .interval_s = truth->period_s(), .temperature_degc = 30}, bytes);
  Sniffer sniffer(all);
  sniffer.feed(std::span(bytes).subspan(7), 0);
  const SniffScore best = sniffer.ranking().front();
  EXPECT_EQ(best.description->name, truth->name) << sniff_line(best);
  EXPECT_TRUE(best.fits) << sniff_line(best);
  EXPECT_GE(best.frames, 198u);
}

INSTANTIATE_TEST_SUITE_P(Frames, Described, testing::ValuesIn(test::described()), [](const auto& one) {
  std::string name = one.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(Exponents, AreWrittenByTheEncoder) {
  FrameEncoder encoder(test::shipped("exponent"));
  Bytes bytes;
  encoder.encode({.rate_deg_per_h = {4.5}, .interval_s = 0.01, .temperature_degc = -12.5}, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "+1.25000000E-03,-1.2500e+01,1\r\n");
}

TEST(HexDigits, AreWrittenInTwosComplement) {
  FrameEncoder places(test::shipped("hex-digits"));
  Bytes bytes;
  places.encode({.rate_deg_per_h = {-0.02}, .interval_s = 0.01, .temperature_degc = -8.5625}, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end() - 4), "$FFFFFEFBB8018");
  FrameEncoder columns(test::shipped("hex-columns"));
  bytes.clear();
  columns.encode({.rate_deg_per_h = {-0.029}, .interval_s = 0.01, .temperature_degc = 25.1}, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end() - 3), "#FFFFFFE3;25.10;001");
}

/// A description of text lines "r,n" with a counter `n` of this type.
std::string counting_lines(const std::string& type) {
  std::string text = one_type(R"("length": {"terminator": "0A", "min": 4, "max": 20}, "text": {"separators": ","},
      "fields": {"r": {"column": 0, "type": "decimal"}, "n": {"column": 1, "type": )" +
                                  type + "}}",
                              "");
  text.back() = ',';
  return text + R"( "counter": {"field": "n", "ticks_per_s": 1}})";
}

TEST(Counters, InTextAreIntegers) {
  for (const char* type : {R"("decimal")", R"("hex")"}) {
    const auto readings =
        test::decode(test::description_of(counting_lines(type)), characters("0,8\n0,9\n0,9.5\n0,-1\n0,z\n0,10\n"));
    std::vector<int> counts;
    for (const DecodedMessage& reading : readings)
      counts.push_back(reading.has_counter ? static_cast<int>(reading.counter) : -1);
    EXPECT_THAT(counts, testing::ElementsAre(8, 9, 0, 0, 0, type[1] == 'h' ? 16 : 10)) << type;
  }
}

TEST(Counters, InDigitsWrapAtTheirWidth) {
  const auto frame = [](const std::string& type) {
    std::string text = one_type(R"("sync": {"bytes": "3A"}, "length": 9,
        "fields": {"r": {"at": 1, "type": "s32"}, "n": {"at": 5, "type": )" +
                                    type + "}}",
                                "");
    text.back() = ',';
    return text + R"( "counter": {"field": "n"}})";
  };
  const auto digits = test::description_of(frame(R"("digits", "bytes": 2)"));
  EXPECT_EQ(digits->counter->modulus, 100u);
  const auto readings = test::decode(digits, characters(":    98..:    99..:    00..:    01.."));
  ASSERT_EQ(readings.size(), 4u);
  EXPECT_EQ(readings[2].counter, 0u);
  EXPECT_EQ(digits->counter->ticks_between(readings[1].counter, readings[2].counter), 1u);
}

TEST(TextChecks, AreWrittenInDecimalDigits) {
  const auto description = test::description_of(one_type(
      R"("length": {"terminator": "0D 0A", "min": 6, "max": 20}, "text": {"separators": ",", "write": "{r:.1f},"},
         "checks": {"kind": "sum", "text": "decimal", "mark": ","}, "fields": {"r": {"column": 0, "type": "decimal"}})",
      ""));
  FrameEncoder encoder(description);
  Bytes bytes;
  encoder.encode({.rate_deg_per_h = {1.5}, .interval_s = 1}, bytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "1.5,148\r\n") << "'1' + '.' + '5' = 49 + 46 + 53";
  EXPECT_TRUE(inspect_frame(*description, bytes));
}

TEST(Vectors, NameTheByteOrderInWhichTheCheckFits) {
  const std::string members = R"("sync": {"bytes": "AB"}, "length": 5, "fields": {"r": {"at": 1, "type": "u16"}},
      "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2})";
  const Crc crc({16, 0x1021, 0, false, false, 0});
  const std::uint64_t sum = crc.compute(Bytes{0xAB, 0x01, 0x02});
  const auto vector = [&](std::uint64_t first, std::uint64_t second) {
    return fmt::format(R"({{"hex": "AB 01 02 {:02X} {:02X}", "kind": "k", "values": {{"r": 258}}}})", first, second);
  };
  EXPECT_EQ(error_of(one_type(members, vector(sum >> 8, sum & 0xFF))), "good");
  EXPECT_EQ(
      error_of(one_type(members, vector(sum & 0xFF, sum >> 8))),
      "t.json:/vectors/0: 0 of 5 bytes are a frame; expected one frame of message type k; the check fails in this "
      "byte order, but fits with \"order\": \"little\"");
  EXPECT_EQ(
      error_of(one_type(members, vector(0x12, 0x34))),
      fmt::format("t.json:/vectors/0: 0 of 5 bytes are a frame; expected one frame of message type k; sync and "
                  "length fit, the check does not: found 12 34, computed {:02X} {:02X} over bytes 0 to 2; no usual "
                  "variant fits",
                  sum >> 8, sum & 0xFF));
  const std::uint64_t other = Crc({16, 0x1021, 0xFFFF, false, false, 0}).compute(Bytes{0xAB, 0x01, 0x02});
  EXPECT_THAT(error_of(one_type(members, vector(other >> 8, other & 0xFF))),
              testing::HasSubstr("it fits with \"poly\": \"0x1021\", \"init\": \"0xFFFF\""));
}

GyroChoice three_axes() {
  GyroChoice choice;
  choice.axes = {{.axis = "x"}, {.axis = "y"}, {.axis = "z"}};
  choice.sensors = true;
  return choice;
}

TEST(Sensors, AreReadByNameWithAThermometerPerAxis) {
  const auto stim = test::shipped("stim300", three_axes());
  ASSERT_EQ(stim->sensors().size(), 9u);
  FrameEncoder encoder(stim);
  GyroState state{.rate_deg_per_h = {1, 2, 3}, .interval_s = stim->period_s(), .temperature_degc = 20};
  for (std::size_t i = 0; i < stim->sensors().size(); ++i) state.sensors[i] = 30 + static_cast<double>(i);
  state.sensors[0] = 20;
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 3; ++i) encoder.encode(state, bytes);
  const auto readings = test::decode(stim, bytes);
  ASSERT_FALSE(readings.empty());
  drivers::Clock clock(stim);
  ASSERT_TRUE(clock.push(readings.back()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(stim->sensors()[axis].sensor.name, std::string("gyro_temp_") + "xyz"[axis]);
    EXPECT_EQ(readings.back().sensors[axis], state.sensors[axis]);
    EXPECT_EQ(clock.sample(readings.back(), axis)->temperature_degc, state.sensors[axis]);
  }
}

// The form with one axis: its model was trained with this temperature.
TEST(Sensors, AreOptional) {
  GyroChoice choice;
  choice.axes = {{.axis = "y"}};
  const auto stim = test::shipped("stim300", choice);
  EXPECT_TRUE(stim->sensors().empty());
  EXPECT_EQ(stim->axes[0].thermometer, -1);
  EXPECT_EQ(stim->id, test::shipped("stim300", three_axes())->id);
}

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
    for (std::size_t i = 0; i < description->sensors().size(); ++i)
      row.push_back(std::isnan(reading.sensors[i]) ? 1e9 : reading.sensors[i]);
  }
  return found;
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
  ASSERT_EQ(logger->sensors().size(), 12u);
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
