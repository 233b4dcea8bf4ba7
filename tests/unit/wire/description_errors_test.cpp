// SPDX-License-Identifier: MIT
// Every error in a description is reported in one line: position, found, expected.
#include <gtest/gtest.h>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

// A small good description; each row of the table below breaks it in one place.
constexpr const char* kGood = R"({
  "format": "prism-frames", "version": 1, "name": "small", "line": {"baud": 9600}, "rate_hz": 10,
  "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 12,
             "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
             "fields": {"rate": {"at": 2, "type": "s32"}, "flags": {"at": 6, "type": "u8"}, "low": {"at": 6, "type": "u4"},
                        "t": {"at": 7, "type": "s16", "when": {"field": "low", "values": [1, 2]}}, "n": {"at": 9, "type": "u8"}}}],
  "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}},
  "counter": {"field": "n"}, "temperature": {"field": "t"}})";

std::string refusal(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  if (at == std::string::npos) return "the test's own text has no " + from;
  text.replace(at, from.size(), to);
  const auto parsed = parse_frame_description(text, "f.json");
  return parsed ? "accepted" : parsed.error().text();
}

TEST(Description, TakesAScaleAsManualsStateIt) {
  for (const auto& [text, value] : {std::pair{"1/16777216", 1.0 / 16777216},
                                    {"2^-24", 1.0 / 16777216},
                                    {"250/2^23", 250.0 / 8388608},
                                    {"0.5", 0.5},
                                    {"-1/4", -0.25}}) {
    std::string changed = kGood;
    changed.replace(changed.find("\"s32\""), 5, std::string("\"s32\", \"scale\": \"") + text + '"');
    const auto parsed = parse_frame_description(changed, "f.json");
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ((*parsed)->kinds[0].fields[0].scaling.scale, value) << text;
  }
}

TEST(Description, CompilesAGoodDescription) {
  const auto parsed = parse_frame_description(kGood, "f.json");
  ASSERT_TRUE(parsed) << parsed.error().text();
  const FrameDescription& d = **parsed;
  EXPECT_EQ(d.name, "small");
  EXPECT_EQ(d.max_frame_bytes, 12u);
  EXPECT_EQ(d.wire.bits_per_byte(), 10);
  EXPECT_EQ(d.counter->modulus, 256u);
  EXPECT_TRUE(d.temperature.present);
  EXPECT_FALSE(d.uhfo.present);
  EXPECT_EQ(d.id.size(), 16u);
  EXPECT_EQ(d.kinds[0].check_bits, 16);
}

struct Slip {
  const char* from;
  const char* to;
  const char* message;
};

class Refusals : public testing::TestWithParam<Slip> {};

TEST_P(Refusals, ReportPositionFoundAndExpected) {
  EXPECT_EQ(refusal(GetParam().from, GetParam().to), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    Slips, Refusals,
    testing::Values(
        Slip{"\"version\": 1", "\"version\": 2", "f.json:/version: found 2, expected 1"},
        Slip{"\"length\": 12,",
             "\"length\": 12, \"items\": {\"from\": 2, \"to\": -2}, \"blocks\": {\"from\": 2, \"mask\": \"flags\", "
             "\"sizes\": [1]},",
             "f.json:/kinds/0: has more than one of \"text\", \"items\", \"blocks\"; expected at most one"},
        Slip{"\"baud\": 9600", "\"baud\": 9600, \"bauds\": 1",
             "f.json:/line/bauds: unknown key in line 2; did you mean \"baud\"?"},
        Slip{"\"version\": 1", "\"version\": 1, \"version\": 1", "f.json: the key \"version\" is given twice"},
        Slip{"\"gyro\"", "\"giro\"", "f.json: \"gyro\" is missing; found \"giro\" in line 7"},
        Slip{"\"baud\": 9600", "\"baud\": \"fast\"",
             "f.json:/line/baud: found \"fast\", expected an integer within 50 to 20000000"},
        Slip{"\"rate_hz\": 10", "\"rate_hz\": 1000",
             "f.json:/rate_hz: 1000 frames/s of 12 bytes need 1250 % of a line of 9600 baud; expected at most 100 %"},
        Slip{"\"AB CD\"", "\"AB C\"",
             "f.json:/kinds/0/sync/bytes: found \"AB C\", expected bytes in hex like \"A5 5A\""},
        Slip{"\"bytes\": \"AB CD\"", "\"bytes\": \"AB CD\", \"mask\": \"FF\"",
             "f.json:/kinds/0/sync/mask: found 1 bytes; expected 2 as in \"bytes\""},
        Slip{"{\"bytes\": \"AB CD\"}", "[{\"bytes\": \"AB\"}, {\"bytes\": \"CD\"}]",
             "f.json:/kinds/0/sync: sets byte 0 twice"},
        Slip{"{\"bytes\": \"AB CD\"}", "{\"at\": 20, \"bytes\": \"AB\"}",
             "f.json:/kinds/0/sync: byte 20 is outside the frame of 12 bytes"},
        Slip{"\"length\": 12", "\"length\": {\"at\": 1, \"type\": \"u8\", \"min\": 9, \"max\": 8}",
             "f.json:/kinds/0/length/max: 8 is below min 9"},
        Slip{"\"to\": -2, \"at\": -2", "\"to\": 0, \"at\": -2",
             "f.json:/kinds/0/checks: the CRC at -2 is inside the bytes 0 to 0 that it covers"},
        Slip{"\"to\": -2, \"at\": -2", "\"to\": -2, \"at\": 11",
             "f.json:/kinds/0/checks: a check of 2 bytes at 11 is outside the frame of 12 bytes"},
        Slip{"\"n\": {\"at\": 9", "\"n\": {\"at\": 10", "f.json:/kinds/0/fields/n: overlaps a check"},
        Slip{"\"n\": {\"at\": 9", "\"n\": {\"at\": 12",
             "f.json:/kinds/0/fields/n: bytes 12 to 12 are outside its 12 bytes"},
        Slip{"\"flags\": {\"at\": 6, \"type\": \"u8\"}", "\"flags\": {\"at\": 5, \"type\": \"u16\"}",
             "f.json:/kinds/0/fields/flags: overlaps a part of \"rate\"; expected none of it or all"},
        Slip{"\"type\": \"s32\"", "\"type\": \"int32\"",
             "f.json:/kinds/0/fields/rate/type: found \"int32\", expected one of u1 to u64, s2 to s64, f32, f64, "
             "digits, "
             "decimal, hex"},
        Slip{"\"type\": \"s32\"", "\"type\": \"s32\", \"order\": [0, 1, 2, 2]",
             "f.json:/kinds/0/fields/rate/order: found [0,1,2,2], expected an order of the bytes 0 to 3, the most "
             "significant first"},
        Slip{"\"type\": \"s32\"", "\"type\": \"s32\", \"scale\": \"1/0\"",
             "f.json:/kinds/0/fields/rate/scale: found \"1/0\", expected a number, or a text such as \"1/16777216\", "
             "\"2^-24\", \"250/2^23\""},
        Slip{"\"axes\": {\"z\"", "\"valid\": {\"field\": \"flags\", \"mask\": 2, \"value\": 1}, \"axes\": {\"z\"",
             "f.json:/gyro/valid/value: found 1, expected bits of the mask 2: (field & mask) is compared"},
        Slip{"\"type\": \"s32\"", "\"type\": \"s32\", \"scale\": 0",
             "f.json:/kinds/0/fields/rate/scale: 0 makes every value the same; expected another number"},
        Slip{"\"field\": \"low\"", "\"field\": \"n\"",
             "f.json:/kinds/0/fields/t/when/field: no field \"n\" before this one"},
        Slip{"{\"z\": \"rate\"}", "{\"z\": \"speed\"}", "f.json:/gyro/axes/z: no message type has a field \"speed\""},
        Slip{"{\"z\": \"rate\"}", "{}", "f.json:/gyro/axes: found none, expected at least one axis"},
        Slip{"\"unit\": \"deg/h\"", "\"unit\": \"deg\"",
             "f.json:/gyro/unit: found \"deg\", expected \"deg/h\" or \"arcsec/s\" or \"deg/s\" or \"rad/s\" or "
             "\"pulse/s\""},
        Slip{"{\"field\": \"n\"}", "{\"field\": \"n\", \"modulus\": 512}",
             "f.json:/counter/modulus: 512 is more than the field's 256"},
        Slip{"{\"field\": \"n\"}", "{\"field\": \"n\", \"step\": 300}",
             "f.json:/counter/modulus: 256 is not above the step of 300 ticks a frame"},
        Slip{"\"rate_hz\"", "\"stuffing\": \"slip\", \"rate_hz\"",
             "f.json:/stuffing: removed in prism 0.4 (line 2); no description of prism is of stuffed frames"},
        Slip{"\"length\": 12", "\"length\": {\"at\": 2, \"type\": \"u8\", \"multiply\": 2, \"max\": 12}",
             "f.json:/kinds/0/length/multiply: removed in prism 0.4 (line 3); a length field counts bytes"},
        Slip{
            "\"to\": -2", "\"to\": -2, \"word_order\": \"big\"",
            "f.json:/kinds/0/checks/word_order: removed in prism 0.4 (line 4); words are added in the \"order\" of the "
            "check"},
        Slip{"\"to\": -2", "\"to\": -2, \"covers_mark\": true",
             "f.json:/kinds/0/checks/covers_mark: removed in prism 0.4 (line 4); the covered bytes end before the "
             "\"mark\""},
        Slip{
            "\"type\": \"s32\"",
            "\"type\": \"s32\", \"convert\": [{\"step\": \"polynomial\", \"coefficients\": [0, 2]}]",
            "f.json:/kinds/0/fields/rate/convert/0/coefficients: removed in prism 0.4 (line 5); use the step \"table\" "
            "with points of the polynomial"},
        Slip{
            "{\"field\": \"t\"}",
            "{\"high\": \"n\", \"low\": \"low\", \"convert\": [{\"step\": \"thermistor\", \"a\": 0.1, \"b\": 0.1}]}",
            "f.json:/temperature/convert/0/a: removed in prism 0.4 (line 8); use the step \"table\" with points of the "
            "thermistor"},
        Slip{"{\"field\": \"t\"}", "{\"field\": \"t\", \"high\": \"n\"}",
             "f.json:/temperature/high: only valid for halves (\"high\", \"low\"); with \"field\" set it in "
             "the field"}));

TEST(Description, ReportsInvalidJsonWithItsLine) {
  const auto parsed = parse_frame_description("{\n  \"format\": \"prism-frames\",\n  oops\n}", "f.json");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.error().text(),
            "f.json:3:3: not valid JSON: syntax error while parsing object key - invalid literal; last read: "
            "'\"prism-frames\",<U+000A>  o'; expected string literal");
}

TEST(Description, RejectsAnInvalidChoice) {
  GyroChoice axis;
  axis.axes = {{.axis = "w"}};
  EXPECT_EQ(parse_frame_description(kGood, "f.json", axis).error().text(),
            "f.json:/gyro/axes: unknown axis \"w\"; expected one of z");
  GyroChoice scale;
  scale.axes[0].scale_factor_arcsec_per_pulse = 0.5;
  EXPECT_EQ(parse_frame_description(kGood, "f.json", scale).error().text(),
            "f.json:/gyro/unit: is \"deg/h\": a scale factor in arcsec/pulse does not apply");
}

TEST(Description, AppliesTheChosenScale) {
  GyroChoice choice;
  choice.axes = {{.sign = -1, .scale_factor_arcsec_per_pulse = 0.25}};
  EXPECT_EQ(test::shipped("trplg", choice)->axes[0].scale, -0.25);
  choice = {};
  choice.axes = {{.axis = "y"}};
  EXPECT_NEAR(test::shipped("novatel-rawimusx", choice)->axes[0].scale, -206264.806, 1e-3) << "the log carries minus y";
}

TEST(Description, UsesTheChosenRate) {
  GyroChoice choice;
  choice.rate_hz = 125;
  const auto stim = test::shipped("stim300", choice);
  EXPECT_EQ(stim->rate_hz, 125);
  EXPECT_EQ(stim->counter->ticks_per_frame, 16) << "2000 samples a second";
  choice.rate_hz = 0;
  EXPECT_EQ(parse_frame_description(kGood, "f.json", choice).error().text(),
            "f.json: found a rate of 0 Hz, expected 0.01 to 100000");
}

TEST(Description, IdDependsOnContentNotComments) {
  const std::string with_comment = std::string("// a comment\n") + kGood;
  EXPECT_EQ(test::description_of(with_comment)->id, test::description_of(kGood)->id);
  std::string other = kGood;
  other.replace(other.find("\"small\""), 7, "\"other\"");
  EXPECT_NE(test::description_of(other)->id, test::description_of(kGood)->id);
}

}  // namespace
}  // namespace prism::wire
