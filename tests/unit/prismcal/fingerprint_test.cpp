// SPDX-License-Identifier: MIT
// Detection of training data in test data: the same file, or the same data in another file.
#include "tools/prismcal/recordings/fingerprint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/prismcal/simulated_day.hpp"

namespace prism::recordings {
namespace {

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
  table.seconds.for_each([&](std::int64_t second, double rate) {
    if (lost-- <= 0) other.seconds.push(second + later, std::round(rate / resolution) * resolution);
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
