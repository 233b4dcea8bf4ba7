// SPDX-License-Identifier: MIT
// Bits of every width, order and grouping, read and written.
#include "drivers/wire/description/field.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "base/json_document.hpp"
#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
namespace {

Field field_of(const char* json) {
  const Result<JsonDocument> document = parse_json_object(json, "test");
  const Section section(*document);
  const FieldDraft draft = read_field(section, "f", true, false, 0);
  EXPECT_TRUE(section.finish()) << section.finish().error().text();
  return draft.field;
}

double number(const char* json, std::vector<std::uint8_t> bytes) { return load_number(field_of(json), bytes.data()); }

TEST(Field, ReadsOrdersAndSigns) {
  EXPECT_EQ(number(R"({"at": 0, "type": "u16"})", {0x12, 0x34}), 0x1234);
  EXPECT_EQ(number(R"({"at": 0, "type": "u16", "order": "little"})", {0x12, 0x34}), 0x3412);
  EXPECT_EQ(number(R"({"at": 0, "type": "s24"})", {0xFF, 0xFF, 0xFE}), -2);
  EXPECT_EQ(number(R"({"at": 0, "type": "s24", "order": [1, 2, 0]})", {0x18, 0xFF, 0xFC}), -1000)
      << "Fizoptika: low, high, middle";
  EXPECT_EQ(number(R"({"at": 0, "type": "u8"})", {0xFF}), 255);
  EXPECT_EQ(number(R"({"at": 0, "type": "s32"})", {0x80, 0, 0, 0}), -2147483648.0);
}

TEST(Field, ReadsSevenBitGroups) {
  EXPECT_EQ(number(R"({"at": 0, "type": "s32", "group": 7, "order": "little"})", {0x47, 0x1F, 0x7F, 0x7F, 0x0F}),
            -12345);
  EXPECT_EQ(number(R"({"at": 0, "type": "s28", "group": 7})", {0x7F, 0x7B, 0x5D, 0x10}), -70000)
      << "most significant first";
  EXPECT_EQ(number(R"({"at": 0, "type": "s14", "group": 7, "order": "little"})", {0x30, 0x7B}), -592);
}

TEST(Field, ReadsPartsOfBytesAndFloats) {
  EXPECT_EQ(number(R"({"at": 0, "type": "u2", "shift": 3})", {0b00011000}), 3);
  EXPECT_EQ(number(R"({"at": 0, "type": "s26", "bytes": 4})", {0x83, 0xFF, 0xFF, 0xFF}), -1)
      << "DSP-3000: flags above the sign";
  EXPECT_EQ(number(R"({"at": 0, "type": "f32"})", {0x3F, 0xC0, 0, 0}), 1.5);
  EXPECT_EQ(number(R"({"at": 0, "type": "f64", "order": "little"})", {0, 0, 0, 0, 0, 0, 0xF8, 0xBF}), -1.5);
  EXPECT_EQ(number(R"({"at": 0, "type": "s48", "order": [4, 5, 0, 1, 2, 3]})", {0x80, 0, 0, 0, 0x00, 0x01}),
            1.5 * 4294967296)
      << "Xsens 16.32: the fraction first, then the whole part";
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

}  // namespace
}  // namespace prism::wire
