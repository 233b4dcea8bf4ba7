// SPDX-License-Identifier: MIT
// Descriptions: every error is one line with position, found and expected, and the schema agrees with the reader.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "base/json_document.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "drivers/wire/description/keys.hpp"
#include "tests/support/blocks.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/schema_validator.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

// Small good descriptions of binary and of text frames; each block of description_errors.txt and text_errors.txt
// changes one in one place.
constexpr const char* kGood = R"({
  "format": "prism-frames", "version": 1, "name": "small", "line": {"baud": 9600}, "rate_hz": 10,
  "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 12,
             "checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2},
             "fields": {"rate": {"at": 2, "type": "s32"}, "flags": {"at": 6, "type": "u8"}, "low": {"at": 6, "type": "u4"},
                        "t": {"at": 7, "type": "s16", "when": {"field": "low", "values": [1, 2]}}, "n": {"at": 9, "type": "u8"}}}],
  "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}},
  "counter": {"field": "n"}, "temperature": {"field": "t"}})";
constexpr const char* kGoodText = R"({
  "format": "prism-frames", "version": 1, "name": "small", "line": {"baud": 9600}, "rate_hz": 10,
  "kinds": [{"name": "k", "after": "0A", "length": {"terminator": "0D 0A", "max": 40},
             "text": {"separators": ",", "columns": 4, "write": "A,{rate:.3f},{t:.1f},{n:d}"},
             "fields": {"rate": {"column": 1, "type": "decimal"}, "t": {"column": 2, "type": "decimal", "decimals": 1},
                        "n": {"column": 3, "type": "decimal", "decimals": 0}}}],
  "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}},
  "counter": {"field": "n"}, "temperature": {"field": "t"}})";

std::string refusal(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) return "the test's own text has no " + from;
  text.replace(at, from.size(), to);
  const auto parsed = parse_frame_description(text, "f.json");
  if (!parsed) return parsed.error().text();
  const auto proved = run_test_vectors(**parsed);
  return proved ? "accepted" : proved.error().text();
}

TEST(Description, CompilesAGoodDescription) {
  const auto parsed = parse_frame_description(kGood, "f.json");
  ASSERT_TRUE(parsed) << parsed.error().text();
  const FrameDescription& d = **parsed;
  EXPECT_EQ(d.name, "small");
  EXPECT_EQ(d.max_frame_bytes, 12u);
  EXPECT_EQ(d.wire.bits_per_byte(), 10);
  EXPECT_EQ(d.counter->modulus, 256u);
  EXPECT_TRUE(d.has(ChannelRole::kTemperature));
  EXPECT_FALSE(d.has(ChannelRole::kUhfo));
  EXPECT_EQ(d.id.size(), 16u);
  EXPECT_EQ(d.kinds[0].check_bits, 16);
}

TEST(Description, EveryErrorReportsPositionFoundAndExpected) {
  for (const test::Block& slip : test::blocks("wire/description_errors.txt", 3))
    EXPECT_EQ(refusal(kGood, slip[0], slip[1]), slip[2]) << slip.where;
  for (const test::Block& slip : test::blocks("wire/text_errors.txt", 3))
    EXPECT_EQ(refusal(kGoodText, slip[0], slip[1]), slip[2]) << slip.where;
}

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
}

TEST(Description, IdDependsOnContentNotComments) {
  const std::string with_comment = std::string("// a comment\n") + kGood;
  EXPECT_EQ(test::description_of(with_comment)->id, test::description_of(kGood)->id);
  std::string other = kGood;
  other.replace(other.find("\"small\""), 7, "\"other\"");
  EXPECT_NE(test::description_of(other)->id, test::description_of(kGood)->id);
}

Json load(const std::filesystem::path& path) { return Json::parse(test::read_file(path), nullptr, true, true); }

/// With one test vector only: they are all alike, and each change costs a run of both readers.
Json load_short(const std::string& name) {
  Json description = load(test::frames_dir() / (name + ".json"));
  if (description.contains("vectors")) description["vectors"].get_ref<Json::array_t&>().resize(1);
  return description;
}

Json schema() { return load(test::frames_dir() / "frame.schema.json"); }

std::vector<std::pair<std::string, Json>> shipped_json() {
  std::vector<std::pair<std::string, Json>> all;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() == ".json" && entry.path().stem() != "frame.schema")
      all.emplace_back(entry.path().stem(), load(entry.path()));
  }
  return all;
}

bool reader_accepts(const Json& description) { return parse_frame_description(description.dump(), "x").has_value(); }

TEST(Schema, IsWrittenFromTheTable) {
  test::expect_generated("config/frames/frame.schema.json", test::schema_text(frame_schema()));
}

TEST(Schema, AcceptsEveryShippedDescription) {
  const test::SchemaValidator validator(schema());
  for (const auto& [name, description] : shipped_json()) EXPECT_TRUE(validator.accepts(description)) << name;
}

/// Calls visit(pointer) for every value of a document.
void walk(const Json& json, const Json::json_pointer& at, const std::function<void(const Json::json_pointer&)>& visit) {
  if (!at.empty()) visit(at);
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) walk(value, at / key, visit);
  } else if (json.is_array()) {
    for (std::size_t i = 0; i < json.size(); ++i) walk(json[i], at / i, visit);
  }
}

std::vector<Json> wrong_values() { return {nullptr, -1, 3, 1e12, "", "0x7", Json::array({1, 2}), Json{{"what", 1}}}; }

// Replaces each value of a description by values of every type. If the schema rejects the result, so does the reader;
// if the reader accepts it, so does the schema.
TEST(Schema, AcceptsEveryFormThatTheReaderAccepts) {
  const test::SchemaValidator validator(schema());
  int refused_by_both = 0;
  for (const char* name : {"trplg", "fizoptika", "microstrain-mip", "ixblue-phins-nmea"}) {
    const Json original = load_short(name);
    ASSERT_TRUE(reader_accepts(original));
    walk(original, Json::json_pointer(), [&](const Json::json_pointer& at) {
      for (const Json& wrong : wrong_values()) {
        Json changed = original;
        changed[at] = wrong;
        const bool read = reader_accepts(changed);
        const bool formed = validator.accepts(changed);
        EXPECT_FALSE(read && !formed) << name << at.to_string() << " = " << wrong.dump()
                                      << ": only the schema refuses it";
        refused_by_both += !read && !formed ? 1 : 0;
      }
    });
  }
  EXPECT_GT(refused_by_both, 1500);
}

// The reader may reject what the schema accepts, but not for a key or a type: those belong in the schema.
TEST(Schema, RejectsTheTypesAndKeysThatTheReaderRejects) {
  const test::SchemaValidator validator(schema());
  for (const char* name : {"trplg", "fizoptika", "microstrain-mip", "dsp3000-ascii"}) {
    const Json original = load_short(name);
    walk(original, Json::json_pointer(), [&](const Json::json_pointer& at) {
      for (const Json& wrong : {Json(nullptr), Json(true), Json::object({{"what", 1}})}) {
        if (original.at(at).type() == wrong.type()) continue;
        Json changed = original;
        changed[at] = wrong;
        EXPECT_FALSE(validator.accepts(changed)) << name << at.to_string() << " = " << wrong.dump();
        EXPECT_FALSE(reader_accepts(changed)) << name << at.to_string() << " = " << wrong.dump();
      }
    });
  }
}

}  // namespace
}  // namespace prism::wire
