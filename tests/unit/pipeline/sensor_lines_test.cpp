// SPDX-License-Identifier: MIT
// A thermometer on a sensor line: when its values are valid, and that a replay of both captures gives the same rows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "compensation/compensated_text.hpp"
#include "daemon/pipeline/captures.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using testing::ElementsAre;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kBegin = 1'700'000'000 * kSecond;

using Bytes = std::vector<std::uint8_t>;

Bytes line_of(double celsius) {
  const std::string text = std::to_string(celsius) + "\r\n";
  return {text.begin(), text.end()};
}

struct SensorLinesTest : testing::Test {
  SensorLinesTest() : setup(load("trplg")) {}
  pipeline::Setup load(const std::string& frames) {
    std::ofstream(folder.file("gyro.json"))
        << R"({"frames": ")" << frames << R"(", "line": {"device": "/dev/null"}, "socket": {"path": ""},
      "axes": {"z": {"temperature": "chamber.t"}}, "sensor_lines": {"chamber": {"device": "/dev/zero", "stale_after_s": 3,
      "columns": {"t": {"column": 1, "unit": "degC"}}}}})";
    auto loaded = load_setup(folder.file("gyro.json"));
    if (!loaded) throw std::runtime_error(loaded.error().text());
    return *loaded;
  }
  /// One frame, and in between bytes of the next.
  Bytes frame() {
    Bytes bytes;
    encoder().encode({.rate_deg_per_h = {10}, .interval_s = setup.frames->period_s()}, bytes);
    return bytes;
  }
  wire::FrameEncoder& encoder() {
    if (!encoder_) encoder_ = std::make_unique<wire::FrameEncoder>(setup.frames);
    return *encoder_;
  }
  test::TemporaryFolder folder;
  pipeline::Setup setup;  ///< after the folder that it is loaded from
  std::unique_ptr<wire::FrameEncoder> encoder_;
};

/// Chunks of both lines as a live run gets them, in order of arrival.
struct Chunk {
  std::int64_t at_ns;
  bool sensors;
  Bytes bytes;
};

// Of a frame that does not come: the good ones behind it wait for its end, or for a timer.
constexpr std::array<std::uint8_t, 4> kLongHead = {0x75, 0x65, 0x80, 0xF0};

std::vector<Chunk> chunks_of(SensorLinesTest& test, unsigned seed) {
  std::mt19937 random(seed);
  Bytes stream;
  std::vector<Chunk> chunks;
  std::int64_t now = kBegin;
  for (int i = 0; i < 6000; ++i) {
    now += kSecond / 200;
    if (random() % 20 == 0) stream.insert(stream.end(), kLongHead.begin(), kLongHead.end());
    if (random() % 5 == 0) now += kSecond / 20;    // long enough for a timer to give up what waits
    if (random() % 4000 == 0) now += 5 * kSecond;  // no data: values become stale
    const Bytes frame = test.frame();
    stream.insert(stream.end(), frame.begin(), frame.end());
    if (random() % 3 == 0) continue;  // comes with the next
    const std::size_t left = random() % 2 == 0 ? 0 : random() % frame.size();
    const std::size_t now_bytes = stream.size() - std::min(left, stream.size());
    if (now_bytes > 0)
      chunks.push_back({now, false, Bytes(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(now_bytes))});
    stream.erase(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(now_bytes));
    if (random() % 40 == 0) {
      Bytes line = line_of(20 + 0.001 * i);
      if (random() % 5 == 0) line.resize(line.size() - 1);  // torn
      chunks.push_back({now + 1 + static_cast<std::int64_t>(random() % 1000), true, std::move(line)});
    }
  }
  return chunks;
}

std::string rows_text(const Rows& rows) {
  std::string text;
  for (const Rows::Window& window : rows.windows) compensation::append_csv(text, window.row);
  return text;
}

// Timers at any time do not change the rows. Good frames after the start of an incomplete long frame have their arrival
// times.
TEST_F(SensorLinesTest, ARunWithTimersGivesTheRowsOfOneWithout) {
  setup = load("microstrain-mip");
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const std::vector<Chunk> chunks = chunks_of(*this, seed);
    Pipeline live(setup), replay(setup);
    std::string of_live, of_replay;
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      const Chunk& chunk = chunks[i];
      if (chunk.sensors) {
        live.feed_sensors(0, chunk.bytes, chunk.at_ns);
        replay.feed_sensors(0, chunk.bytes, chunk.at_ns);
      } else {
        of_live += rows_text(live.feed(chunk.bytes, chunk.at_ns));
        of_replay += rows_text(replay.feed(chunk.bytes, chunk.at_ns));
      }
      const std::int64_t until = i + 1 < chunks.size() ? chunks[i + 1].at_ns : chunk.at_ns + 1;
      if (random() % 2 == 0) of_live += rows_text(live.expire(chunk.at_ns + (until - chunk.at_ns) / 2));
    }
    of_live += rows_text(live.finish());
    of_replay += rows_text(replay.finish());
    EXPECT_EQ(of_live, of_replay) << "seed " << seed;
    EXPECT_GT(std::count(of_live.begin(), of_live.end(), '\n'), 20);
    EXPECT_NE(of_live.find(",23."), std::string::npos) << "the thermometer's values are in the rows";
  }
}

TEST_F(SensorLinesTest, ItsMeanIsTheAxissTemperatureAndAColumnOfTheLog) {
  Pipeline pipeline(setup);
  std::vector<compensation::CompensatedWindow> rows;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t now = kBegin + i * kSecond / 200;
    if (i % 100 == 0) pipeline.feed_sensors(0, line_of(30), now);
    for (const auto& window : pipeline.feed(frame(), now).windows) rows.push_back(window.row);
  }
  ASSERT_GE(rows.size(), 4u);
  EXPECT_NEAR(rows[2].window.second_mean.temperature_degc, 30, 1e-9);
  EXPECT_THAT(rows[2].window.second_mean.sensors, ElementsAre(30));
}

}  // namespace
}  // namespace prism::pipeline
