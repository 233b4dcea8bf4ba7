// SPDX-License-Identifier: MIT
// A capture gives the same seconds as prismd: it uses the configured line, and only frame descriptions whose test
// vectors pass. Regression: an earlier reader with its own decoder did neither.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/capture_file.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/collected.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::prismcal {
namespace {

constexpr std::int64_t kStart = 1767225600;  // s

class CaptureSource : public testing::Test {
 protected:
  const std::string second_means_ =
      test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "config/frames/second-means.json");

  std::string written(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
    return folder_.file(name);
  }

  /// Ten frames with one-second means, at second + 0.1 s.
  std::string capture() {
    wire::FrameEncoder encoder(*wire::parse_frame_description(second_means_, "second-means"));
    auto writer = drivers::CaptureWriter::open(folder_.file("line.pcap"));
    EXPECT_TRUE(writer);
    for (std::int64_t second = kStart; second < kStart + 10; ++second) {
      wire::GyroState state;
      state.interval_s = 1;
      state.rate_deg_per_h = {8.5};
      state.temperature_degc = 25;
      std::vector<std::uint8_t> bytes;
      encoder.encode(state, bytes);
      EXPECT_TRUE(writer->data(second * 1'000'000'000 + 100'000'000, bytes));
    }
    EXPECT_TRUE(writer->flush());
    return folder_.file("line.pcap");
  }

  Result<test::CollectedRecording> read(const std::string& line, const std::string& frames) {
    recordings::SourceOptions options;
    options.config = written("gyro.json", R"({"name": "bench", "frames": ")" + frames + R"(", "line": {)" + line +
                                              R"(}, "model": "not-yet-made.json"})");
    return test::collected(capture(), options);
  }

 private:
  const test::TemporaryFolder folder_;
};

TEST_F(CaptureSource, StampsFramesByTheConfiguredBaud) {
  const std::string frames = written("frames.json", second_means_);
  const auto fast = read("", frames), slow = read("\"baud\": 1200", frames);
  ASSERT_TRUE(fast) << fast.error().text();
  ASSERT_TRUE(slow) << slow.error().text();
  ASSERT_EQ(slow->second_means.size(), 10u);
  EXPECT_EQ(fast->second_means.front().second, kStart);
  EXPECT_EQ(slow->second_means.front().second, kStart - 1);  // 33 bytes take 0.275 s
  EXPECT_EQ(slow->value("instance"), "bench");
}

TEST_F(CaptureSource, RejectsFramesWhoseTestVectorsFail) {
  std::string wrong = second_means_;
  const std::string last = "03 07 55";
  wrong.replace(wrong.find(last), last.size(), "03 07 56");
  EXPECT_THAT(read("", written("frames.json", wrong)).error().text(),
              testing::HasSubstr("frames.json:/vectors/0: 0 of 33 bytes are a frame"));
}

}  // namespace
}  // namespace prism::prismcal
