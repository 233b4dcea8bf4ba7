// SPDX-License-Identifier: MIT
// Bits of every width, order and grouping, read and written.
#include "drivers/wire/description/field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "base/json_document.hpp"
#include "drivers/wire/description/keys.hpp"

namespace prism::wire {
namespace {

Field field_of(const char* json) {
  const Result<JsonDocument> document = parse_json_object(json, "test");
  const Section section(*document);
  FieldDraft draft;
  field_keys().read(section, draft);
  draft.field.at = draft.at.value();
  EXPECT_TRUE(section.finish()) << section.finish().error().text();
  return draft.field;
}

TEST(Field, WritesOnlyItsOwnBits) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 5000; ++round) {
    const int group = random() % 3 == 0 ? 7 : 8;
    const int shift = static_cast<int>(random() % 5);
    const int bits = 2 + static_cast<int>(random() % static_cast<unsigned>(group == 7 ? 50 : 55));
    const std::string json = "{\"at\": 0, \"type\": \"" + std::string(random() % 2 ? "u" : "s") + std::to_string(bits) +
                             "\", \"group\": " + std::to_string(group) + ", \"shift\": " + std::to_string(shift) +
                             ", \"order\": \"" + (random() % 2 ? "big" : "little") + "\"}";
    const Field field = field_of(json.c_str());
    std::array<std::uint8_t, 8> before{};
    for (auto& byte : before) byte = static_cast<std::uint8_t>(random());
    auto after = before;
    const std::uint64_t value = random() & (~std::uint64_t{0} >> (64 - bits));
    store_bits(field, after.data(), value);
    ASSERT_EQ(load_bits(field, after.data()) & (~std::uint64_t{0} >> (64 - bits)), value) << json;
    store_bits(field, after.data(), load_bits(field, before.data()));
    ASSERT_EQ(after, before) << json << ": other bits were touched";
  }
}

TEST(Field, LimitsNumbersToItsRange) {
  const Field field = field_of(R"({"at": 0, "type": "s8"})");
  std::uint8_t byte = 0;
  for (const auto& [number, expected] : {std::pair{1000.0, 127}, {-1000.0, -128}, {1.6, 2}, {std::nan(""), 0}}) {
    store_number(field, &byte, number);
    EXPECT_EQ(static_cast<std::int8_t>(byte), expected);
  }
}

// IEC 60751, table 1 (PT100), printed to 0.01 ohm; the middle three to 0.0001 ohm.
TEST(Platinum, MatchesTheTableOfIec60751) {
  EXPECT_NEAR(platinum_ohm(-200, 100), 18.52, 0.005);
  EXPECT_NEAR(platinum_ohm(-100, 100), 60.26, 0.005);
  EXPECT_NEAR(platinum_ohm(-40, 100), 84.2707, 5e-5);
  EXPECT_NEAR(platinum_ohm(0, 100), 100, 1e-12);
  EXPECT_NEAR(platinum_ohm(25, 100), 109.7347, 5e-5);
  EXPECT_NEAR(platinum_ohm(70, 100), 127.0751, 5e-5);
  EXPECT_NEAR(platinum_ohm(850, 100), 390.48, 0.005);
}

TEST(Platinum, IsInvertedToANanokelvinOverItsRange) {
  for (double t = -199.9; t < 850; t += 0.37) {
    ASSERT_NEAR(platinum_degc(platinum_ohm(t, 100), 100), t, 1e-9) << t;
    ASSERT_NEAR(platinum_degc(platinum_ohm(t, 1000), 1000), t, 1e-9) << t;
  }
  EXPECT_TRUE(std::isnan(platinum_degc(10, 100))) << "below -200 degC";
  EXPECT_TRUE(std::isnan(platinum_degc(400, 100))) << "above 850 degC";
}

TEST(Bridge, IsTheRatioOfItsArms) {
  const ConversionStep bridge{.kind = ConversionStep::Kind::kBridge, .full = 32767, .reference = 10000};
  EXPECT_DOUBLE_EQ(convert(bridge, 16383.5), 10000);
  EXPECT_NEAR(convert_back(bridge, 10000), 16383.5, 1e-9);
  EXPECT_EQ(convert(bridge, 0), 0);
  EXPECT_EQ(convert_back(bridge, 0), 0);
  EXPECT_NEAR(convert_back(bridge, convert(bridge, 0.5)), 0.5, 1e-9);
  EXPECT_TRUE(std::isnan(convert(bridge, 32767))) << "an open bridge";
  EXPECT_TRUE(std::isnan(convert(bridge, -0.5)));
  EXPECT_TRUE(std::isnan(convert_back(bridge, -0.5)));
}

TEST(Table, IsLinearBetweenItsPointsAndUnknownOutside) {
  const ConversionStep table{.x = {0, 10, 20}, .y = {100, 50, 40}};
  EXPECT_DOUBLE_EQ(convert(table, 0), 100);
  EXPECT_DOUBLE_EQ(convert(table, 5), 75);
  EXPECT_DOUBLE_EQ(convert(table, 15), 45);
  EXPECT_DOUBLE_EQ(convert(table, 20), 40);
  EXPECT_DOUBLE_EQ(convert_back(table, 45), 15);
  EXPECT_TRUE(std::isnan(convert(table, 20.1)));
  EXPECT_TRUE(std::isnan(convert(table, std::nan(""))));
}

TEST(Conversion, AppliesAndInvertsItsSteps) {
  const Conversion scaling{25e-6, 0, -100, 150, {{.kind = ConversionStep::Kind::kPlatinum}}};
  EXPECT_NEAR(scaling.apply(4389386), 25, 1e-4);
  EXPECT_NEAR(scaling.invert(25), 4389386, 0.5);
  EXPECT_TRUE(scaling.admits(25));
  EXPECT_FALSE(scaling.admits(151));
  EXPECT_FALSE(scaling.admits(std::nan("")));
}

}  // namespace
}  // namespace prism::wire
