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
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {
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

using testing::HasSubstr;

BlockTable day(int seconds, std::uint64_t seed, double earth_rate_deg_per_h = test::kDayEarthRate) {
  return make_block_table(test::simulated_day(seconds, 0.07, seed), {}, earth_rate_deg_per_h, "day").value();
}

Recording files(const std::vector<std::string>& sha256) {
  Recording recording;
  for (const std::string& checksum : sha256) recording.files.push_back({"log.csv", checksum, 1});
  return recording;
}

struct Fingerprint : testing::Test {
  std::string provenance =
      nlohmann::ordered_json(
          {{"recordings",
            {{{"files", {{{"path", "a.csv"}, {"sha256", "aa"}}}}, {"fingerprint", fingerprint_json(day(8000, 1))}}}}})
          .dump();
};

TEST_F(Fingerprint, DetectsTheSameFile) {
  EXPECT_THAT(overlap_text(provenance, files({"aa"}), day(8000, 9)), HasSubstr("this file"));
  EXPECT_THAT(overlap_text(provenance, files({"bb", "aa"}), day(8000, 9)), HasSubstr("1 of these 2 files"));
}

TEST_F(Fingerprint, DetectsTheSameDataInAnotherFile) {
  EXPECT_THAT(overlap_text(provenance, files({"bb"}), day(8000, 1)), HasSubstr("(32 of 32 compared seconds"));
  EXPECT_THAT(overlap_text(provenance, files({"bb"}), day(4000, 1)), HasSubstr("(16 of 16 compared seconds"));
  EXPECT_THAT(overlap_text(provenance, files({"bb"}), day(8000, 1, 0)),
              HasSubstr("(32 of 32"));  // as with --no-earth-rate
}

/// As another program writes it: rates with a few decimals, other times, and without the first seconds.
BlockTable exported(const BlockTable& table, double resolution, std::int64_t later, int lost) {
  BlockTable other = table;
  other.seconds = {};
  for_each_known(table.seconds, [&](std::int64_t second, double rate) {
    if (lost-- <= 0) append(other.seconds, second + later, std::round(rate / resolution) * resolution);
  });
  return other;
}

TEST_F(Fingerprint, DetectsTheSameDataOfAnotherProgram) {
  const BlockTable table = day(8000, 1);
  for (const std::int64_t later : {0, 3600, -1'700'000'000})
    EXPECT_THAT(overlap_text(provenance, files({"bb"}), exported(table, 1e-3, later, 3)),
                HasSubstr("31 compared seconds"))
        << later;
  EXPECT_EQ(overlap_text(provenance, files({"bb"}), exported(day(8000, 2), 1e-3, 3600, 3)), "");
  // Equal by chance: rates that are coarser than their noise.
  EXPECT_EQ(overlap_text(provenance, files({"bb"}), exported(day(8000, 2), 0.2, 0, 0)), "");
  const std::string coarse =
      nlohmann::ordered_json({{"recordings",
                               {{{"files", {{{"path", "a.csv"}, {"sha256", "aa"}}}},
                                 {"fingerprint", fingerprint_json(exported(day(8000, 1), 0.2, 0, 0))}}}}})
          .dump();
  for (const std::uint64_t seed : {1, 2})
    EXPECT_EQ(overlap_text(coarse, files({"bb"}), exported(day(8000, seed), 0.2, 0, 0)), "");
  EXPECT_THAT(overlap_text(coarse, files({"aa"}), exported(day(8000, 1), 0.2, 0, 0)), HasSubstr("this file"));
}

// All simulated captures start in the same second.
TEST_F(Fingerprint, IgnoresEqualTimesWithOtherData) {
  EXPECT_EQ(overlap_text(provenance, files({"bb"}), day(8000, 2)), "");
}

TEST_F(Fingerprint, ReturnsNothingForInvalidProvenance) {
  for (const char* text : {"", "{}", "[]", "not JSON", R"({"recordings": 3})",
                           R"({"recordings": [{"files": [1], "fingerprint": [[1], "x"]}]})"})
    EXPECT_EQ(overlap_text(text, files({"aa"}), day(8000, 1)), "") << text;
}

}  // namespace
}  // namespace prism::recordings
