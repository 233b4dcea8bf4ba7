// SPDX-License-Identifier: MIT
// Plausibility limits in a description (ranges and a slope): values, errors, not part of the id. Values outside the
// limits of their field do not count as missing.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

std::string believed_text(const std::string& gyro, const std::string& temperature, const std::string& uhfo) {
  return R"({"format": "prism-frames", "version": 1, "name": "small", "line": {"baud": 9600}, "rate_hz": 10,
    "kinds": [{"name": "k", "sync": {"bytes": "AB CD"}, "length": 8, "checks": {"kind": "sum", "to": -1, "at": -1},
               "fields": {"rate": {"at": 2, "type": "s16", "min": -100, "max": 100},
                          "t": {"at": 4, "type": "s16", "min": -80, "max": 125}, "u": {"at": 6, "type": "u8"}}}],
    "gyro": {"meaning": "rate", "unit": "deg/s", "axes": {"z": "rate"})" +
         gyro + R"(}, "temperature": {"field": "t")" + temperature + R"(}, "uhfo": {"field": "u")" + uhfo + "}}";
}

std::string refused_belief(const std::string& gyro, const std::string& temperature, const std::string& uhfo) {
  const auto parsed = parse_frame_description(believed_text(gyro, temperature, uhfo), "f.json");
  return parsed ? "accepted" : parsed.error().text();
}

TEST(Beliefs, AreReadInTheUnitsOfTheQuantities) {
  const auto d = test::description_of(believed_text(R"(, "range_deg_per_s": [-490, 490])",
                                                    R"(, "range": [-40, 75], "greatest_slope_degc_per_s": 0.5)",
                                                    R"(, "range": [0, 16])"));
  EXPECT_EQ(d->plausible.rate.range->max, 490 * 3600.0);
  EXPECT_EQ(d->plausible.temperature.range->min, -40);
  EXPECT_EQ(d->plausible.temperature.greatest_slope_per_s, 0.5);
  EXPECT_EQ(d->plausible.uhfo.range->max, 16);
  EXPECT_FALSE(d->plausible.temperature.stuck_s);
}

// Logs identify a description by its id: adding a plausibility limit does not change the decoding.
TEST(Beliefs, AreNotPartOfTheId) {
  const auto without = test::description_of(believed_text("", "", ""));
  const auto with = test::description_of(
      believed_text(R"(, "range_deg_per_s": [-1, 1])", R"(, "range": [-40, 75])", R"(, "range": [0, 1])"));
  EXPECT_EQ(without->id, with->id);
  EXPECT_FALSE(without->plausible.rate.range || without->plausible.temperature.range);
  EXPECT_NE(without->id, test::description_of(believed_text("", R"(, "stale_after_s": 2)", ""))->id);
}

TEST(Beliefs, ReportErrorsWithTheirPosition) {
  EXPECT_EQ(refused_belief("", R"(, "range": [75, -40])", ""),
            "f.json:/temperature/range: found [75, -40], expected [low, high], low below high");
  EXPECT_EQ(refused_belief("", R"(, "range": [1])", ""),
            "f.json:/temperature/range: found [1], expected [low, high], low below high");
  EXPECT_NE(
      refused_belief(R"(, "range_deg_per_s": "wide")", "", "").find("f.json:/gyro/range_deg_per_s: found \"wide\""),
      std::string::npos);
  EXPECT_NE(
      refused_belief("", R"(, "greatest_slope_degc_per_s": 0)", "").find("/temperature/greatest_slope_degc_per_s"),
      std::string::npos);
  EXPECT_EQ(refused_belief("", "", R"(, "greatest_slope_degc_per_s": 1)"),
            "f.json:/uhfo/greatest_slope_degc_per_s: only valid for the temperature");
}

// Units that differ from the role's: a temperature in K is 273.15 too high without a word.
TEST(Units, OfTheTemperatureAndTheVoltageAreChecked) {
  const auto refusal = [](const std::string& field, const std::string& unit) {
    std::string text = believed_text("", "", "");
    const std::string name = "\"" + field + "\": {";
    text.replace(text.find(name), name.size(), name + "\"unit\": \"" + unit + "\", ");
    const auto parsed = parse_frame_description(text, "f.json");
    return parsed ? "" : parsed.error().text();
  };
  EXPECT_EQ(refusal("t", "K"),
            "f.json:/temperature/field: the field \"t\" is in K, expected degC; add \"offset\": "
            "-273.15 to the field, and make its \"unit\" degC");
  EXPECT_EQ(refusal("t", "degF"), "f.json:/temperature/field: the field \"t\" is in degF, expected degC");
  EXPECT_EQ(refusal("t", "degC"), "");
}

std::vector<std::uint8_t> small_frame(int rate, int temperature) {
  std::vector<std::uint8_t> bytes = {0xAB, 0xCD};
  for (const int value : {rate, temperature}) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  bytes.push_back(5);
  int sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  bytes.push_back(static_cast<std::uint8_t>(sum));
  return bytes;
}

TEST(OutOfBounds, IsReportedForEachQuantity) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 8; ++i) {
    const auto one = small_frame(i == 4 ? 1000 : 10, i >= 5 ? -273 : 25);
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  const auto readings = test::decode(test::description_of(believed_text("", "", "")), bytes);
  ASSERT_EQ(readings.size(), 8u);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    EXPECT_EQ(readings[i].out_of_bounds, (QuantitySet{false, i >= 5, false})) << i;
    EXPECT_EQ(readings[i].gyro[0].out_of_bounds, i == 4) << i;
    EXPECT_EQ(std::isnan(readings[i].temperature_degc), i >= 5) << i;
    EXPECT_EQ(readings[i].gyro[0].valid, i != 4) << i;
  }
}

}  // namespace
}  // namespace prism::wire
