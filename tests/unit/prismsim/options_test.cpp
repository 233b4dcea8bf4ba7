// SPDX-License-Identifier: MIT
// prismsim's command line: values and errors.
#include "tools/prismsim/options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>
#include <vector>

#include "tests/support/blocks.hpp"

namespace prism::prismsim {
namespace {

struct Parsed {
  SimOptions options;
  std::optional<int> code;
  std::string complaint;
};

/// Parses words that are separated by blanks; the description is a shipped one, or a file.
Parsed parse(const std::string& line, const std::string& frames = "trplg") {
  const std::string file =
      frames[0] == '/' ? frames : std::string(PRISM_SOURCE_DIR) + "/config/frames/" + frames + ".json";
  std::istringstream in("prismsim " + line + " --frames " + file);
  std::vector<std::string> words(std::istream_iterator<std::string>(in), {});
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  Parsed parsed;
  testing::internal::CaptureStderr();
  parsed.code = parse_sim_options(static_cast<int>(argv.size()), argv.data(), parsed.options);
  parsed.complaint = testing::internal::GetCapturedStderr();
  return parsed;
}

TEST(SimOptions, DefaultToOnePaperCycleAtTheDescribedRateInXian) {
  const Parsed parsed = parse("--out a.pcap");
  ASSERT_FALSE(parsed.code) << parsed.complaint;
  EXPECT_EQ(parsed.options.simulation.profile.name, "paper");
  EXPECT_EQ(parsed.options.simulation.rate_hz, 200);
  EXPECT_NEAR(parsed.options.simulation.earth_rate_deg_per_h[0], 8.4652, 5e-5);
  EXPECT_EQ(parsed.options.total_frames(), 18'480'000u);
  EXPECT_FALSE(parsed.options.terminal);
  EXPECT_EQ(parsed.options.speed, 1.0);
}

// Regression: five of six messages of this device have no delta angle. Sent at 100 per second in total, they changed
// 8.5 deg/h to 51, because the message counter runs at 600 per second.
TEST(SimOptions, UseTheRateOfFramesWithGyroData) {
  EXPECT_EQ(parse("--out a.pcap", "hg4930").options.simulation.rate_hz, 600);
}

// Regression: at 10 frames/s, time tags advanced as at 1000, and prismd rejected the capture.
TEST(SimOptions, ScaleACounterOfTimeToTheRateSent) {
  const auto step = [](const std::string& rate, const char* frames) {
    const Parsed parsed = parse("--out a.pcap --rate " + rate, frames);
    return parsed.code ? -1 : parsed.options.frames->counter->ticks_per_frame;
  };
  EXPECT_EQ(step("10", "stim300"), 200);
  EXPECT_EQ(step("1000", "stim300"), 2);
  EXPECT_EQ(step("10", "trplg"), 1) << "counts frames";
  const Parsed slow = parse("--out a.pcap --rate 5", "stim300");
  EXPECT_EQ(slow.code, 64);
  EXPECT_THAT(slow.complaint, testing::HasSubstr("--rate: found 5, expected more than 7.8125: the counter of "
                                                 "\"stim300\" begins again after 256 ticks, 2000 a second"));
}

TEST(SimOptions, ReadTheBiasComponents) {
  const Parsed parsed = parse(
      "--out a.pcap --profile warm-up --smooth --sensor-lag 300 --hysteresis 1 --turn-on 2 --warm-up 3 --flicker 4 "
      "--mode-hops 5 --ageing 6 --tilt 7 --thermal-ageing 8 --age 9");
  ASSERT_FALSE(parsed.code) << parsed.complaint;
  const simulation::BiasModelSettings& truth = parsed.options.simulation.truth;
  EXPECT_EQ(parsed.options.simulation.profile.name, "warm-up");
  EXPECT_TRUE(truth.smooth);
  EXPECT_EQ(
      (std::vector{truth.sensor_lag_s, truth.hysteresis_deg_per_h, truth.turn_on_deg_per_h, truth.warm_up_deg_per_h,
                   truth.flicker_deg_per_h, truth.mode_hops_deg_per_h, truth.ageing_deg_per_h_per_day,
                   truth.tilt_deg_per_h, truth.thermal_ageing_per_day, truth.age_days}),
      (std::vector<double>{300, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(parse("--out a.pcap --flicker -1").code, 64);
}

TEST(SimOptions, ReadDurationFaultsAndSite) {
  const Parsed parsed = parse(
      "--link gyro --speed max --hours 0.5 --rate 1000 --elevation -90 --outliers 3 --lose-frames 0.25 --drop-bytes "
      "1e-3 --damage-bytes 1e-4");
  ASSERT_FALSE(parsed.code) << parsed.complaint;
  const simulation::SimulationSettings& simulation = parsed.options.simulation;
  EXPECT_TRUE(parsed.options.terminal);
  EXPECT_EQ(parsed.options.speed, std::nullopt);
  EXPECT_EQ(parsed.options.total_frames(), 1'800'000u);
  EXPECT_NEAR(simulation.earth_rate_deg_per_h[0], -8.4652, 5e-5);
  EXPECT_EQ(simulation.outliers_per_h, 3);
  EXPECT_EQ(simulation.lose_frames, 0.25);
  EXPECT_EQ(simulation.drop_bytes, 1e-3);
  EXPECT_EQ(simulation.damage_bytes, 1e-4);
  EXPECT_EQ(parse("--out a --cycles 2").options.duration_s, 2 * 92400);
}

TEST(SimOptions, ReportErrorsInOneLine) {
  for (const test::Block& row : test::blocks("prismsim/option_errors.txt", 2)) {
    const Parsed parsed = parse(row.text(0));
    EXPECT_EQ(parsed.code, 64) << row.where;
    EXPECT_EQ(parsed.complaint, "prismsim: " + row[1] + "\n") << row.where;
  }
  EXPECT_EQ(parse("--out a --axis q").code, 78);
}

TEST(SimOptions, ReturnTheExitCodeOfABadDescription) {
  const Parsed parsed = parse("--out a", "/nowhere/x.json");
  EXPECT_EQ(parsed.code, 78);
  EXPECT_EQ(parsed.complaint, "prismsim: --frames: /nowhere/x.json: cannot be read: No such file or directory\n");
}

}  // namespace
}  // namespace prism::prismsim
