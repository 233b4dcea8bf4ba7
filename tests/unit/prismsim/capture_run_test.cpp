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

}  // namespace
}  // namespace prism::prismsim
