// SPDX-License-Identifier: MIT
// A device with three axes: each axis behaves as if alone, and is selected by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "compensation/model_text.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/models.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::socket {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;
constexpr double kRates[] = {10, -20, 30};

struct AxesTest : testing::Test {
  Result<pipeline::Setup> load(const std::string& members) {
    std::ofstream(folder.file("imu.json")) << R"({"name": "imu", "frames": "stim300", "line": {"device": "/dev/null"},
      "socket": {"path": ")" << folder.file("socket")
                                           << R"("}, )" << members << "}";
    return pipeline::load_setup(folder.file("imu.json"));
  }
  pipeline::Setup good(const std::string& members) {
    auto setup = load(members);
    if (!setup) throw std::runtime_error(setup.error().text());
    return *setup;
  }
  std::string refusal(const std::string& members) {
    const auto setup = load(members);
    return setup ? "accepted" : setup.error().text();
  }
  std::string write_model(const std::string& name, const std::string& serial) {
    compensation::ModelInfo info;
    info.kind = "polynomial";
    info.inputs = {"T"};
    info.gyro_serial = serial;
    info.domain = {{-40}, {80}};
    const std::vector<compensation::Term> terms = {{{0}, 0.5}, {{1}, 0.01}};
    const compensation::PolynomialModel model(std::move(info), terms, 0.001);
    std::ofstream(folder.file(name)) << compensation::format_model(model);
    return folder.file(name);
  }

  static constexpr const char* kThree = R"("axes": {"x": {}, "y": {"sign": -1}, "z": {}})";
  test::TemporaryFolder folder;
};

/// Seconds of frames whose axes turn at kRates; `valid`: the axes that the device marks as valid.
void feed(pipeline::Pipeline& pipeline, const wire::FrameDescriptionPtr& sender, int seconds,
          const std::function<std::array<bool, wire::kMaxAxes>(int)>& valid,
          const std::function<void(const pipeline::Rows&)>& take) {
  wire::FrameEncoder encoder(sender);
  const double period_s = sender->period_s();
  const int frames = static_cast<int>(seconds / period_s);
  for (int i = 0; i < frames; ++i) {
    std::vector<std::uint8_t> bytes;
    encoder.encode({.rate_deg_per_h = {kRates[0], kRates[1], kRates[2]},
                    .interval_s = period_s,
                    .temperature_degc = 25,
                    .valid = valid(i)},
                   bytes);
    take(pipeline.feed(bytes, kBegin_ns + std::llround(1e9 * period_s * (i + 1))));
  }
  take(pipeline.finish());
}

std::string text_of(const compensation::CompensatedWindow& row) {
  std::string text;
  compensation::append_csv(text, row);
  return text;
}

TEST_F(AxesTest, EachIsWhatItWouldBeAlone) {
  const auto three = good(kThree);
  std::vector<std::vector<std::string>> together(3);
  pipeline::Pipeline all(three);
  const auto flicker = [](int i) -> std::array<bool, wire::kMaxAxes> { return {i % 7 != 0, true, i < 300, true}; };
  feed(all, three.frames, 3, flicker, [&](const pipeline::Rows& rows) {
    for (const auto& window : rows.windows) together[window.axis].push_back(text_of(window.row));
  });
  const char* alone[] = {R"("axes": {"x": {}})", R"("axes": {"y": {"sign": -1}})", R"("axes": {"z": {}})"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    pipeline::Pipeline one(good(alone[axis]));
    std::vector<std::string> rows;
    feed(one, three.frames, 3, flicker, [&](const pipeline::Rows& made) {
      for (const auto& window : made.windows) rows.push_back(text_of(window.row));
    });
    EXPECT_EQ(together[axis], rows) << alone[axis];
    EXPECT_GE(rows.size(), 3u);
  }
}

// The frame's status has a bit for each axis.
TEST_F(AxesTest, AnAxisThatIsNotValidIsUnknownAndTheOthersGoOn) {
  const auto setup = good(kThree);
  pipeline::Pipeline pipeline(setup);
  std::vector<std::vector<double>> rates(3);
  const auto y_is_gone = [](int) -> std::array<bool, wire::kMaxAxes> { return {true, false, true, true}; };
  feed(pipeline, setup.frames, 2, y_is_gone, [&](const pipeline::Rows& rows) {
    for (const auto& sample : rows.samples) rates[sample.axis].push_back(sample.row.sample.rate_deg_per_h);
  });
  ASSERT_GT(rates[0].size(), 100u);
  EXPECT_EQ(rates[0].size(), rates[1].size());
  for (std::size_t i = 0; i < rates[0].size(); ++i) {
    EXPECT_NEAR(rates[0][i], kRates[0], 1);
    EXPECT_TRUE(std::isnan(rates[1][i]));
    EXPECT_NEAR(rates[2][i], kRates[2], 1);
  }
}

TEST_F(AxesTest, WhatDoesNotGoTogetherIsRefusedInOneLine) {
  const std::string file = folder.file("imu.json");
  EXPECT_EQ(refusal(R"("model": "m", "axes": {"x": {}})"),
            file + ":/model: given together with \"axes\"; expected it in each axis of \"axes\"");
  EXPECT_EQ(refusal(R"("gyro": {"axis": "x"}, "axes": {"x": {}})"),
            file + ":/gyro/axis: given together with \"axes\"; expected it in each axis of \"axes\"");
  EXPECT_EQ(refusal(R"("site": {"elevation_deg": 0}, "axes": {"x": {}})"),
            file + ":/site/elevation_deg: given together with \"axes\"; expected it in each axis of \"axes\"");
  EXPECT_EQ(refusal(R"("axes": {})"), file + ":/axes: found none, expected at least one axis");
  EXPECT_THAT(refusal(R"("axes": {"w": {}})"), HasSubstr(":/gyro/axes: unknown axis \"w\"; expected one of x, y, z"));
  EXPECT_THAT(refusal(R"("axes": {"x": {}, "x": {}})"), HasSubstr("the key \"x\" is given twice"));
  EXPECT_THAT(refusal(R"("axes": {"x/y": {}})"), HasSubstr("expected 1 to 16 letters, digits or _"));
  EXPECT_THAT(refusal(R"("axes": {"x": {"scale_factor_arcsec_per_pulse": 1}})"), HasSubstr("does not apply"));
  const std::string a = write_model("a.json", "A"), b = write_model("b.json", "B");
  EXPECT_EQ(refusal(R"("axes": {"x": {"model": ")" + a + R"("}, "y": {"model": ")" + b + R"("}})"),
            b + ":/gyro/serial: found \"B\", but " + a + " is of gyro \"A\"; expected models of the same gyro");
}

TEST_F(AxesTest, ALogIsNamedAfterItsAxisWhereTheConfigurationNamesAxes) {
  const auto three = good(kThree), one = good(R"("gyro": {"axis": "y"})");
  EXPECT_EQ(pipeline::log_name(three, 1), "imu-y");
  EXPECT_EQ(pipeline::log_name(one, 0), "imu");
  EXPECT_THAT(pipeline::log_metadata(three, 2), HasSubstr("# axis: z\n"));
  EXPECT_THAT(good(R"("clock": "host")").notes.back(),
              HasSubstr("found no \"axis\" or \"axes\"; using x, the first of x, y, z"));
}

TEST_F(AxesTest, AReloadThatIsRefusedLeavesEveryAxisAsItWas) {
  const auto setup = good(kThree);
  test::DaemonParts parts(setup);
  auto other = good(R"("axes": {"x": {}, "y": {"sign": -1}})");
  EXPECT_THAT(parts.device.reconfigure(other).error().text(),
              HasSubstr("found logs imu-x, imu-y, expected imu-x, imu-y, imu-z as before; restart prismd"));
  auto deaf = setup;
  deaf.axes[0].model = test::linear_model({"dTdt"}, {1});
  deaf.axes[2].fallback = test::linear_model({"dTdt"}, {1});  // needs inputs that a fallback may not
  if (parts.device.reconfigure(deaf)) GTEST_FAIL() << "the fallback of z was taken";
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(parts.device.pipeline->axes()[axis].engine.model(), nullptr);
}

TEST_F(AxesTest, SystemdsStatusHasTheQualityOfEachAxis) {
  test::DaemonParts parts(good(kThree));
  const Sources sources{parts.device, parts.events, parts.publisher, parts.started_ns};
  EXPECT_EQ(summary(sources), "/dev/null: waiting");
  parts.begin_session(kBegin_ns);
  EXPECT_EQ(summary(sources), "receiving from /dev/null, 0 frames, quality x no_data, y no_data, z no_data");
}

}  // namespace
}  // namespace prism::socket
