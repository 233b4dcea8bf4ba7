// SPDX-License-Identifier: MIT
// A run to a capture: every frame is in it with the times of a real line; the truth is written next to it.
#include "tools/prismsim/capture_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/capture_file.hpp"
#include "drivers/clock.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismsim/truth_file.hpp"

namespace prism::prismsim {
namespace {

// 20 s of the paper's cycle, 200 frames/s of 20 bytes.
SimOptions twenty_seconds(const std::string& out) {
  SimOptions options;
  const std::string path = std::string(PRISM_SOURCE_DIR) + "/config/frames/trplg.json";
  options.frames = *wire::parse_frame_description(test::read_file(path), path);
  options.duration_s = 20;
  options.out = out;
  return options;
}

TEST(CaptureRun, DatesEachFrameByItsLastByte) {
  const test::TemporaryFolder folder;
  const SimOptions options = twenty_seconds(folder.file("a.pcap"));
  const auto counters = run_capture(options);
  ASSERT_TRUE(counters) << counters.error().text();
  EXPECT_EQ(counters->frames, 4000u);
  auto reader = drivers::CaptureReader::open(options.out);
  ASSERT_TRUE(reader);
  const auto first = reader->next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->event, drivers::CaptureEvent::kOpened);
  EXPECT_EQ(first->time_ns, kCaptureStart_ns);
  std::int64_t frames = 0;
  while (const auto packet = reader->next()) {
    ++frames;
    ASSERT_EQ(packet->bytes.size(), 20u);
    // 5 ms an interval, then 20 bytes of 10 bits at 921 600 baud: 217 014 ns
    ASSERT_EQ(packet->time_ns, kCaptureStart_ns + frames * 5'000'000 + 217'014);
  }
  EXPECT_EQ(frames, 4000);
  EXPECT_EQ(reader->tail_damage(), "");
}

TEST(CaptureRun, SplitsPacketsAtAnySizeWithoutChangingBytes) {
  const test::TemporaryFolder folder;
  SimOptions options = twenty_seconds(folder.file("a.pcap"));
  const auto bytes_of = [&](std::uint64_t chunk) {
    options.chunk_bytes = chunk;
    EXPECT_TRUE(run_capture(options));
    auto reader = drivers::CaptureReader::open(options.out);
    std::vector<std::uint8_t> bytes;
    std::int64_t last_ns = 0;
    while (const auto packet = reader->next()) {
      EXPECT_LE(packet->bytes.size(), chunk > 0 ? chunk : 20);
      EXPECT_GE(packet->time_ns, last_ns);
      last_ns = packet->time_ns;
      bytes.insert(bytes.end(), packet->bytes.begin(), packet->bytes.end());
    }
    EXPECT_EQ(last_ns, kCaptureStart_ns + 20'000'217'014);
    return bytes;
  };
  const auto whole = bytes_of(0);
  EXPECT_EQ(whole.size(), 80'000u);
  EXPECT_EQ(bytes_of(7), whole);
  EXPECT_EQ(bytes_of(4096), whole);
}

TEST(CaptureRun, WritesTheTruthOfTheSamples) {
  const test::TemporaryFolder folder;
  SimOptions options = twenty_seconds(folder.file("a.pcap"));
  options.truth = folder.file("truth.csv");
  ASSERT_TRUE(run_capture(options));
  const std::string truth = test::read_file(options.truth);
  EXPECT_EQ(std::count(truth.begin(), truth.end(), '\n'), 7 + 20);
  EXPECT_NE(truth.find("\n2026-01-01T00:00:20Z,1767225620,20.000000,"), std::string::npos);
}

TEST(CaptureRun, SlowLineFallsBehind) {
  const test::TemporaryFolder folder;
  SimOptions options = twenty_seconds(folder.file("a.pcap"));
  options.simulation.rate_hz = 10'000;  // 2 Mbit/s on a line of 0.92
  options.duration_s = 1;
  ASSERT_TRUE(run_capture(options));
  auto reader = drivers::CaptureReader::open(options.out);
  std::int64_t last_ns = 0;
  while (const auto packet = reader->next()) last_ns = packet->time_ns;
  EXPECT_NEAR(static_cast<double>(last_ns - kCaptureStart_ns) * 1e-9, 10'000 * 20 * 10 / 921'600.0, 1e-3);
}

TEST(CaptureRun, ReportsAFileThatCannotBeWritten) {
  const auto refused = run_capture(twenty_seconds("/nowhere/a.pcap"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text(), "/nowhere/a.pcap: cannot be written: No such file or directory");
}

constexpr std::int64_t kSecond = 1'000'000'000;

simulation::GyroTruth truth_at(double elapsed_s) {
  simulation::GyroTruth truth{elapsed_s, 25, 25.5, 25.25, 0.001, 5.32, 0.0123456, 25.375, {}, 0};
  truth.causes = {0.01, 0.001, 0.0002, -0.0003, 0.0004, 0.0005, 0.0006, -0.0000544, 0.0007};
  truth.case_degc = 26;
  return truth;
}

std::string rows_of(const std::string& text) { return text.substr(text.find("time_utc")); }

TEST(TruthFile, DescribesTheSimulationAndWritesOneRowPerSecond) {
  const test::TemporaryFolder folder;
  simulation::SimulationSettings settings;
  settings.seed = 42;
  {
    auto file = TruthFile::open(folder.file("truth.csv"), settings);
    ASSERT_TRUE(file) << file.error().text();
    for (int i = 1; i <= 5; ++i) ASSERT_TRUE(file->push(1'767'225'600 * kSecond + i * kSecond / 2, truth_at(i * 0.5)));
    ASSERT_TRUE(file->flush());
  }
  const std::string text = test::read_file(folder.file("truth.csv"));
  EXPECT_EQ(text.find("# simulated: "), 0u);
  EXPECT_NE(text.find("\n# profile: paper\n# seed: 42\n"), std::string::npos);
  EXPECT_EQ(
      rows_of(text),
      "time_utc,time_s,elapsed_s,chamber_degc,body_degc,inner_degc,slope_degc_per_s,uhfo_v,bias_deg_per_h,"
      "sensor_degc,thermal_deg_per_h,hysteresis_deg_per_h,turn_on_deg_per_h,warm_up_deg_per_h,flicker_deg_per_h,"
      "mode_hops_deg_per_h,ageing_deg_per_h,tilt_deg_per_h,gradient_deg_per_h,case_degc\n"
      "2026-01-01T00:00:01Z,1767225601,1.000000,25.00000,25.500000,25.250000,0.001000000,5.320000,0.0123456,"
      "25.375000,0.0100000,0.0010000,0.0002000,-0.0003000,0.0004000,0.0005000,0.0006000,-0.0000544,0.0007000,26.00000\n"
      "2026-01-01T00:00:02Z,1767225602,2.000000,25.00000,25.500000,25.250000,0.001000000,5.320000,0.0123456,"
      "25.375000,0.0100000,0.0010000,0.0002000,-0.0003000,0.0004000,0.0005000,0.0006000,-0.0000544,0.0007000,26."
      "00000\n");
}

// A terminal's time begins within a second: the first row is at the first second that ends.
TEST(TruthFile, StartsWithTheFirstFullSecond) {
  const test::TemporaryFolder folder;
  {
    auto file = TruthFile::open(folder.file("truth.csv"), {});
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->push(1'767'225'600 * kSecond + kSecond / 4, truth_at(0.1)));
    ASSERT_TRUE(file->push(1'767'225'601 * kSecond + kSecond / 4, truth_at(1.1)));
  }
  const std::string rows = rows_of(test::read_file(folder.file("truth.csv")));
  EXPECT_EQ(rows.find("2026-01-01T00:00:01Z,1767225601,1.100000,"), rows.find('\n') + 1);
}

TEST(TruthFile, ReportsAFileThatCannotBeWritten) {
  const auto absent = TruthFile::open("/nowhere/truth.csv", {});
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().text(), "/nowhere/truth.csv: cannot be written: No such file or directory");
  const auto device = TruthFile::open("/dev/null", {});
  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().text(), "/dev/null: is a device, expected a regular file");
}

}  // namespace
}  // namespace prism::prismsim
