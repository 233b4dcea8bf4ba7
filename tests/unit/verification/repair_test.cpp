// SPDX-License-Identifier: MIT
// The repaired copy: intact files are unchanged, damage is left out and listed, and the original is not modified.
#include "tools/prismcal/verification/repair.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>

#include "base/text_number.hpp"
#include "tests/support/collected.hpp"
#include "tests/unit/verification/injected_faults.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::verification {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

struct RepairTest : InjectedFaults {
  const std::string out = folder.file("clean");

  // Returns "FILE:LINE: WHY" for everything left out.
  std::vector<std::string> left_out(const std::string& from) {
    const auto repaired = repair(from, out);
    EXPECT_TRUE(repaired) << repaired.error().text();
    std::vector<std::string> lines;
    for (const auto& row : repaired ? repaired->left_out : std::vector<recordings::LeftOutRow>())
      lines.push_back(fmt::format("{}:{}: {}", std::filesystem::path(row.path).filename().string(), row.line, row.why));
    EXPECT_THAT(faults(out), IsEmpty());
    return lines;
  }
  static std::string error_of(const std::string& from, const std::string& to) {
    const auto repaired = repair(from, to);
    return repaired ? "no error" : repaired.error().text();
  }
  static std::map<std::string, std::string> all_files(const std::string& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) files[entry.path().string().substr(folder.size())] = test::content(entry.path());
    }
    return files;
  }
  std::vector<std::int64_t> seconds_in(const std::string& path) const {
    const auto recording = test::collected(path);
    EXPECT_TRUE(recording) << recording.error().text();
    std::vector<std::int64_t> seconds;
    for (const auto& second_mean : recording ? recording->second_means : std::vector<compensation::SecondMean>())
      seconds.push_back(second_mean.second + 1 - kNoon);
    return seconds;
  }
};

TEST_F(RepairTest, CopiesIntactSegmentsUnchanged) {
  segment(0, 5);
  segment(10, 5);
  EXPECT_THAT(left_out(log), IsEmpty());
  auto before = all_files(log), after = all_files(out);
  EXPECT_NE(before["/gyro1.csv.index"], after["/gyro1.csv.index"]) << "the copy is a new log with its own id";
  before.erase("/gyro1.csv.index");
  after.erase("/gyro1.csv.index");
  EXPECT_EQ(before, after);
}

TEST_F(RepairTest, LeavesOutFaultsByFileAndLineAndCopiesTheRest) {
  segment(0, 4);
  segment(10, 4);
  segment(20, 4);
  segment(30, 4);
  segment(40, 4);
  cut(path(0), lines_of(path(0)).back().size() + 20);
  auto lines = lines_of(path(10));
  const std::size_t line = line_of_row(path(10), 2);
  lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(line), lines[line - 1]);
  write(path(10), lines);
  replace(path(20), "8.010000", "8.01x000");
  std::filesystem::remove(path(30));
  test::write_file(path(50), test::content(path(40)));
  test::write_file(path(60), "# prism 0.2.0 data log, for");
  const auto before = all_files(log);
  EXPECT_THAT(left_out(log),
              UnorderedElementsAre(
                  HasSubstr(fmt::format("{}:{}: ", name(0), line_of_row(path(0), 3) + 1)),
                  fmt::format("{}:{}: repeats a second of its session", name(10), line + 1),
                  HasSubstr(fmt::format("{}:{}: column rate_deg_per_h", name(20), line_of_row(path(20), 1) + 1)),
                  fmt::format("{}:0: identical to another file", name(50)),
                  HasSubstr(name(60) + ":1: 27 bytes of an incomplete row"), name(60) + ":0: found no complete row"));
  EXPECT_EQ(all_files(log), before) << "the original must not change";
  EXPECT_THAT(seconds_in(out), ElementsAre(0, 1, 2, 10, 11, 12, 13, 20, 22, 23, 40, 41, 42, 43));
  EXPECT_THAT(test::content(out + "/" + name(20)),
              HasSubstr("; the segment was changed: it did not match its end line; 1 row left out\n"));
}

TEST_F(RepairTest, RepairsASegmentTruncatedAtAnyByte) {
  segment(0, 3);
  const std::string text = test::content(path(0));
  const std::size_t first_row_end = text.find("\n2026") + 1 + lines_of(path(0))[line_of_row(path(0), 1) - 1].size();
  for (std::size_t length = first_row_end; length < text.size(); length += 7) {
    test::write_file(path(0), text.substr(0, length));
    const auto repaired = repair(path(0), out);
    ASSERT_TRUE(repaired) << length << ": " << repaired.error().text();
    EXPECT_EQ(repaired->segments, 1u);
    EXPECT_EQ(seconds_in(out).size(), repaired->rows) << length;
    std::filesystem::remove_all(out);
  }
}

TEST_F(RepairTest, CopiesASupersededRowOnce) {
  segment(0, 5);
  cut(path(0), lines_of(path(0)).back().size());
  append(*writer("# supersedes: " + name(0) + " from row 4\n"), kNoon + 3, 4);
  const auto second = log + "/" + name(3);
  replace(second, "# session: " + utc_nano_text((kNoon + 2) * 1'000'000'000 + 1),
          "# session: " + utc_nano_text((kNoon - 1) * 1'000'000'000 + 1));
  EXPECT_THAT(left_out(log),
              ElementsAre(HasSubstr("repeated in a later segment"), HasSubstr("repeated in a later segment")));
  EXPECT_THAT(seconds_in(out), ElementsAre(0, 1, 2, 3, 4, 5, 6));
}

TEST_F(RepairTest, CopiesTheRowsOfAnOpenSegment) {
  const auto open = writer();
  append(*open, kNoon, 3);
  EXPECT_THAT(left_out(log), IsEmpty());
  EXPECT_EQ(seconds_in(out).size(), 3u);
  EXPECT_THAT(test::content(out + "/" + name(0)), HasSubstr("# end: rows 3, sha256 "));
}

TEST_F(RepairTest, LosesOnlyTheIncompleteRowOfALogOfVersion01) {
  const std::string from = std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1";
  EXPECT_THAT(left_out(from), ElementsAre(HasSubstr("bytes of an incomplete row")));
  const auto before = test::collected(from), after = test::collected(out);
  ASSERT_TRUE(after);
  EXPECT_EQ(after->second_means.size(), before->second_means.size());
  EXPECT_EQ(after->sessions, before->sessions);
}

TEST_F(RepairTest, KeepsTheCompletePacketsOfATruncatedCapture) {
  const std::string path = capture("gyro1-20261121T120000Z.pcap", 5);
  cut(path, 7);
  EXPECT_THAT(left_out(folder.file("capture")),
              ElementsAre(HasSubstr(":0: 31 bytes from byte 166 on are not a complete packet")));
  EXPECT_THAT(verify(out).findings[0].text, HasSubstr("4 packets, 30 bytes of the line, opened 1 time"));
}

TEST_F(RepairTest, KeepsThePacketsAfterDamageInACapture) {
  const std::string path = capture("gyro1-20261121T120000Z.pcap", 5);
  const std::string text = test::content(path);
  test::write_file(path, text.substr(0, 128) + std::string(64, '\xFF') + text.substr(128));
  EXPECT_THAT(left_out(folder.file("capture")),
              ElementsAre(HasSubstr(":0: 64 bytes in 1 place from byte 128 on are not packets")));
  EXPECT_THAT(verify(out).findings[0].text, HasSubstr("5 packets, 40 bytes of the line, opened 1 time"));
}

TEST_F(RepairTest, CopiesValidModelsWithTheLog) {
  segment(0, 2);
  const std::string model = std::string(PRISM_SOURCE_DIR) + "/config/models/tao2019-model2.json";
  std::filesystem::copy_file(model, log + "/a.json");
  std::filesystem::copy_file(model, log + "/b.json");
  replace(log + "/b.json", "0.008292", "0.008293");
  test::write_file(log + "/notes.txt", "mine");
  EXPECT_THAT(left_out(log), ElementsAre("notes.txt:0: not a file of prism", HasSubstr("b.json:0: /id")));
  EXPECT_EQ(test::content(out + "/a.json"), test::content(model));
}

TEST_F(RepairTest, RejectsOutputInsideTheInputOrNotEmpty) {
  segment(0, 2);
  EXPECT_THAT(error_of(log, log), HasSubstr("is within"));
  EXPECT_THAT(error_of(log, log + "/clean"), HasSubstr("is within"));
  EXPECT_THAT(error_of(log, folder.file("none/../log/clean")), HasSubstr("is within"));
  std::filesystem::create_directory_symlink(log, folder.file("link"));
  EXPECT_THAT(error_of(folder.file("link"), log + "/clean"), HasSubstr("is within"));
  EXPECT_THAT(error_of(log, folder.file("link/clean")), HasSubstr("is within"));
  EXPECT_THAT(error_of(log, folder.file("")), HasSubstr("exists and is not an empty folder"));
  test::write_file(folder.file("file"), "mine");
  EXPECT_THAT(error_of(log, folder.file("file")), HasSubstr("exists and is not an empty folder"));
  EXPECT_THAT(error_of(folder.file("none"), out), HasSubstr("file not found"));
  EXPECT_EQ(all_files(log).size(), 2u);
  std::filesystem::create_directory(out);
  EXPECT_EQ(error_of(log, out), "no error") << "an empty folder";
}

TEST_F(RepairTest, RejectsTwoGyrosAndEmptyInput) {
  segment(0, 2, "# gyro_serial: 70\n");
  segment(10, 2, "# gyro_serial: 71\n");
  EXPECT_THAT(error_of(log, out), HasSubstr("found logs of gyro_serial"));
  test::write_file(folder.file("empty.csv"), "");
  EXPECT_THAT(error_of(folder.file("empty.csv"), folder.file("clean2")), HasSubstr("found nothing to copy"));
}

}  // namespace
}  // namespace prism::verification
