// SPDX-License-Identifier: MIT
// Descriptions for tests, in tests/replay/frames/described: exponents, hexadecimal digits, text checks without a mark.
// damage_test.cpp runs its properties on them too.
#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/clock.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

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
  DecodedMessage last = readings.back();
  last.temperature_degc = 99;  // the device's own
  last.out_of_bounds.temperature = true;
  drivers::Clock clock(stim);
  ASSERT_TRUE(clock.push(last));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(stim->sensors()[axis].sensor.name, std::string("gyro_temp_") + "xyz"[axis]);
    EXPECT_EQ(last.sensors[axis], state.sensors[axis]);
    const auto sample = clock.sample(last, axis);
    EXPECT_EQ(sample->temperature_degc, state.sensors[axis]);
    EXPECT_FALSE(sample->out_of_bounds.temperature);
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

TEST(Instruments, ReportErrorsInOneLine) {
  const auto refusal = [](const std::string& text, const GyroChoice& choice = {}) {
    const auto parsed = parse_frame_description(text, "f.json", choice);
    return parsed ? std::string("accepted") : parsed.error().text();
  };
  std::string bare = test::read_file(test::frames_dir() / "ascii-columns.json"), gyros = bare;
  bare.replace(bare.find("\"sensors\": {},"), 14, "");
  EXPECT_EQ(refusal(bare), "f.json: \"gyro\" is missing");
  gyros.replace(gyros.find("\"sensors\": {},"), 14, "\"sensors\": {}, \"status\": {\"field\": \"first\"},");
  EXPECT_EQ(refusal(gyros), "f.json:/status: only valid with \"gyro\"; use \"sensors\" instead");
  GyroChoice columns;
  columns.text.columns = {{{"t", "degC"}, 0}};
  const std::string not_lines = "f.json: does not describe text lines without a gyro, as required by \"columns\"";
  EXPECT_EQ(refusal(test::read_file(test::frames_dir() / "trplg.json"), columns), not_lines);
  for (const char* kinds :
       {"", R"("kinds": 1)", R"("kinds": {"a": {}})", R"("kinds": [])", R"("kinds": [1])", R"("kinds": [{"text": {}}])",
        R"("kinds": [{"text": {}, "length": 8}])", R"("kinds": [{"text": 1, "length": {}}])",
        R"("kinds": [{"length": {}}])", R"("kinds": [{"text": {}, "length": {}}, {"text": {}, "length": {}}])",
        R"("kinds": [{"text": {}, "length": {}}], "gyro": {})"})
    EXPECT_EQ(refusal(fmt::format("{{{}}}", kinds), columns), not_lines) << kinds;
}

}  // namespace
}  // namespace prism::wire
