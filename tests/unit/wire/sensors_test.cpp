// SPDX-License-Identifier: MIT
// Additional channels of a description, and axes with a thermometer of their own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/clock.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using testing::HasSubstr;

GyroChoice three_axes() {
  GyroChoice choice;
  choice.axes = {{.axis = "x"}, {.axis = "y"}, {.axis = "z"}};
  choice.sensors = true;
  return choice;
}

TEST(Sensors, AreReadByNameWithAThermometerPerAxis) {
  const auto stim = test::shipped("stim300", three_axes());
  ASSERT_EQ(stim->sensors.size(), 9u);
  FrameEncoder encoder(stim);
  GyroState state{.rate_deg_per_h = {1, 2, 3}, .interval_s = stim->period_s(), .temperature_degc = 20};
  for (std::size_t i = 0; i < stim->sensors.size(); ++i) state.sensors[i] = 30 + static_cast<double>(i);
  state.sensors[0] = 20;
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 3; ++i) encoder.encode(state, bytes);
  const auto readings = test::decode(stim, bytes);
  ASSERT_FALSE(readings.empty());
  drivers::Clock clock(stim);
  ASSERT_TRUE(clock.push(readings.back()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(stim->sensors[axis].sensor.name, std::string("gyro_temp_") + "xyz"[axis]);
    EXPECT_EQ(readings.back().sensors[axis], state.sensors[axis]);
    EXPECT_EQ(clock.sample(readings.back(), axis)->temperature_degc, state.sensors[axis]);
  }
}

// The form with one axis: its model was trained with this temperature.
TEST(Sensors, AreOptional) {
  GyroChoice choice;
  choice.axes = {{.axis = "y"}};
  const auto stim = test::shipped("stim300", choice);
  EXPECT_TRUE(stim->sensors.empty());
  EXPECT_EQ(stim->axes[0].thermometer, -1);
  EXPECT_EQ(stim->id, test::shipped("stim300", three_axes())->id);
}

TEST(Sensors, ReportErrorsInOneLine) {
  const std::string text = test::read_file(test::frames_dir() / "kvh-geo-fog.json");
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    if (at == std::string::npos) return "no \"" + from + "\"";
    changed.replace(at, from.size(), to);
    const auto parsed = parse_frame_description(changed, "f.json");
    return parsed ? std::string("accepted") : parsed.error().text();
  };
  const std::string pressure = R"("pressure": {"field": "pressure", "unit": "Pa"})";
  EXPECT_EQ(refusal(pressure, R"("pressure": {"field": "pressure"})"), "f.json:/sensors/pressure: \"unit\" is missing");
  EXPECT_EQ(refusal(pressure, R"("pressure": {"field": "pressure", "unit": "V"})"),
            "f.json:/sensors/pressure/unit: found V, but the field \"pressure\" is in Pa");
  EXPECT_EQ(refusal(pressure, R"("dTdt": {"field": "pressure", "unit": "Pa"})"),
            "f.json:/sensors/dTdt: invalid sensor name, expected letters, digits and _, not T, U, dTdt or lagN");
  EXPECT_EQ(refusal(R"("x": "rate_x")", R"("x": {"field": "rate_x", "temperature": "shell"})"),
            "f.json:/gyro/axes/x/temperature: found \"shell\", expected one of \"sensors\"");
  EXPECT_EQ(refusal(R"("x": "rate_x")", R"("x": {"field": "rate_x", "temperature": "pressure"})"),
            "f.json:/gyro/axes/x/temperature: \"pressure\" is in Pa, expected degC");
  EXPECT_THAT(refusal(pressure, R"("pressure": {"field": "presure", "unit": "Pa"})"),
              HasSubstr("no message type has a field"));
}

}  // namespace
}  // namespace prism::wire
