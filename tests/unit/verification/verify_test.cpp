// SPDX-License-Identifier: MIT
// verify() finds each type of fault with file and line, and reports no fault for intact files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/text_number.hpp"
#include "daemon/log/row_log.hpp"
#include "drivers/capture_file.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/commands.hpp"

namespace prism::verification {
namespace {

using commands::verify;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr std::int64_t kNoon = 1'795'262'400;  // 2026-11-21T12:00:00Z

struct InjectedFaults : testing::Test {
  Problems problems{[](auto, auto&, const std::string& what) { ADD_FAILURE() << what; }};
  /// Opens a log writer in the folder log/.
  std::unique_ptr<log::RowLog> writer(const std::string& metadata = "", const std::string& name = "gyro1") {
    return std::make_unique<log::RowLog>(test::segments_in(log), name,
                                         "# prism 0.2.0 data log, format 2\n# instance: gyro1\n" + metadata, counters,
                                         problems);
  }
  /// Appends rows whose seconds end at first, first + 1, …, as a new session.
  static void append(log::RowLog& rows, std::int64_t first, int count) {
    for (int i = 0; i < count; ++i) {
      compensation::CompensatedWindow row = test::row_at(first + i);
      row.window.second_mean.rate_deg_per_h = 8.0 + 0.01 * (i % 7);
      row.window.second_mean.temperature_degc = 25.0 + 0.001 * i;
      rows.append(row, (first - 1) * 1'000'000'000 + 1);
    }
  }
  /// Writes and closes a segment of `count` rows from kNoon + after_s.
  void segment(int after_s, int count, const std::string& metadata = "") {
    append(*writer(metadata), kNoon + after_s, count);
  }
  /// gyro1-00000N-20261121T1200SSZ.csv: the first segment, or the second one.
  static std::string name(int after_s) {
    return pipeline::SegmentName{.number = after_s == 0 ? 1u : 2u, .begin_s = kNoon + after_s}.file("gyro1", ".csv");
  }
  std::string path(int after_s) const { return log + "/" + name(after_s); }

  static std::vector<std::string> lines_of(const std::string& path) {
    std::vector<std::string> lines;
    std::istringstream in(test::content(path));
    for (std::string line; std::getline(in, line);) lines.push_back(line + "\n");
    return lines;
  }
  static void write(const std::string& path, const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line;
    test::write_file(path, text);
  }
  static void replace(const std::string& path, const std::string& from, const std::string& to) {
    std::string text = test::content(path);
    ASSERT_NE(text.find(from), std::string::npos) << from;
    test::write_file(path, text.replace(text.find(from), from.size(), to));
  }
  static void cut(const std::string& path, std::size_t bytes) {
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - bytes);
  }
  static std::size_t line_of_row(const std::string& path, std::size_t row) {  // from 1
    const auto lines = lines_of(path);
    std::size_t line = 0;
    for (std::size_t rows = 0; rows < row; ++line) rows += lines[line][0] >= '0' && lines[line][0] <= '9';
    return line;
  }

  /// Writes capture/NAME: an opening packet, then one packet of 10 bytes per second; `packets` in all.
  std::string capture(const std::string& name, int packets) {
    std::filesystem::create_directories(folder.file("capture"));
    std::string path = folder.file("capture/" + name);
    auto file = drivers::CaptureWriter::open(path);
    const std::vector<std::uint8_t> bytes(10, 0x24);
    EXPECT_TRUE(file->opened(kNoon * 1'000'000'000));
    for (int i = 1; i < packets; ++i) EXPECT_TRUE(file->data((kNoon + i) * 1'000'000'000, bytes));
    EXPECT_TRUE(file->flush());
    return path;
  }

  /// Returns "FILE: STATE: TEXT" or "FILE:LINE: STATE: TEXT" for each fault, in the order of verify().
  static std::vector<std::string> faults(const std::string& path) {
    std::vector<std::string> found;
    const auto result = verify({path});
    for (const auto& finding : result["findings"]) {
      const std::string file = std::filesystem::path(text(finding, "path")).filename().string();
      if (finding["fault"].get<bool>())
        found.push_back(file + (finding.contains("line") ? ":" + finding["line"].dump() : "") + ": " +
                        text(finding, "state") + ": " + text(finding, "text"));
    }
    EXPECT_EQ(result["faults"].get<std::size_t>(), found.size());
    return found;
  }
  static std::string text(const nlohmann::ordered_json& object, const char* key) {
    return object[key].get<std::string>();
  }
  static std::int64_t number(const nlohmann::ordered_json& object, const char* key) {
    return object[key].get<std::int64_t>();
  }

  const test::TemporaryFolder folder;
  const std::string log = folder.file("log");
  pipeline::LogCounters counters;
};

struct VerifyTest : InjectedFaults {
  std::vector<std::string> faults_of_log() const { return faults(log); }
};

TEST_F(VerifyTest, AClosedSegmentIsIntact) {
  segment(0, 5);
  segment(10, 5);
  const auto result = verify({log});
  EXPECT_EQ(number(result, "faults"), 0);
  ASSERT_EQ(result["findings"].size(), 2u);
  EXPECT_EQ(text(result["findings"][0], "state"), "whole");
  EXPECT_EQ(text(result["findings"][0], "text"), "5 rows, format 2");
  ASSERT_EQ(result["sessions"].size(), 2u);
  EXPECT_EQ(number(result["sessions"][1], "first_s"), kNoon + 10);
  EXPECT_EQ(number(result["sessions"][1], "last_s"), kNoon + 14);
  EXPECT_EQ(number(result["sessions"][1], "rows"), 5);
}

TEST_F(VerifyTest, ReportsMissingSecondsAsGapsNotFaults) {
  const auto rows = writer();
  for (const int second : {0, 1, 5, 6, 9}) {
    compensation::CompensatedWindow row = test::row_at(kNoon + second);
    row.window.second_mean.missing_frames = second == 5 ? 600 : 0;
    row.window.second_mean.partial = second == 9;
    rows->append(row, 1);
  }
  rows->close();
  const auto result = verify({log});
  EXPECT_EQ(number(result, "faults"), 0);
  ASSERT_EQ(result["sessions"].size(), 1u);
  const auto& session = result["sessions"][0];
  EXPECT_EQ(number(session, "missing_s"), 5);
  EXPECT_EQ(number(session, "missing_frames"), 600);
  EXPECT_EQ(number(session, "partial"), 1);
  ASSERT_EQ(session["holes"].size(), 2u);
  EXPECT_EQ(number(session["holes"][0], "first_s"), kNoon + 2);
  EXPECT_EQ(number(session["holes"][0], "last_s"), kNoon + 4);
  EXPECT_EQ(number(session["holes"][1], "first_s"), kNoon + 7);
}

TEST_F(VerifyTest, AnUnclosedSegmentIsOpenWhileLockedElseTruncated) {
  const auto open = writer();
  append(*open, kNoon, 3);
  EXPECT_EQ(text(verify({log})["findings"][0], "state"), "open");
  EXPECT_THAT(faults_of_log(), IsEmpty());
  std::filesystem::copy_file(path(0), path(100));  // not locked, as after a kill
  EXPECT_THAT(faults(path(100)), ElementsAre(name(100) + ": torn: 3 rows, format 2, no end"));
}

TEST_F(VerifyTest, ReportsTheLineOfAnIncompleteRow) {
  segment(0, 5);
  segment(10, 5);
  cut(path(0), lines_of(path(0)).back().size() + 20);
  EXPECT_THAT(faults(path(0)),
              ElementsAre(AllOf(HasSubstr(": torn: 4 rows"), HasSubstr("of an incomplete row from line " +
                                                                       std::to_string(line_of_row(path(0), 5))))));
  EXPECT_THAT(faults_of_log(), testing::Contains(name(0) + ": missing: 1 of 5 rows"));
}

TEST_F(VerifyTest, ReportsTheLineOfADuplicateSecond) {
  segment(0, 5);
  auto lines = lines_of(path(0));
  const std::size_t line = line_of_row(path(0), 3);
  lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(line), lines[line - 1]);
  write(path(0), lines);
  EXPECT_THAT(faults_of_log(),
              ElementsAre(HasSubstr("changed: 6 rows"), name(0) + ":" + std::to_string(line + 1) +
                                                            ": doubled: repeats a second or goes back in its session"));
}

TEST_F(VerifyTest, ReportsARowThatGoesBack) {
  segment(0, 2);
  auto lines = lines_of(path(0));
  const auto rows = writer();
  for (const int second : {100, 101, 110, 105}) rows->append(test::row_at(kNoon + second), 1);
  rows->close();
  EXPECT_THAT(faults_of_log(), ElementsAre(HasSubstr(":" + std::to_string(line_of_row(path(100), 4)) +
                                                     ": doubled: repeats a second or goes back in its session")));
}

TEST_F(VerifyTest, DetectsAChangedDigit) {
  segment(0, 5);
  replace(path(0), "8.010000", "8.910000");
  EXPECT_THAT(faults_of_log(),
              ElementsAre(HasSubstr(": changed: 5 rows, format 2; differs from its end line, or has bytes after it")));
}

TEST_F(VerifyTest, DetectsAFlippedBitInAnyByte) {
  segment(0, 2);
  const std::string text = test::content(path(0));
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string flipped = text;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    test::write_file(path(0), flipped);
    EXPECT_THAT(faults(path(0)), testing::Not(IsEmpty())) << "byte " << at;
  }
}

TEST_F(VerifyTest, ReportsAnUnreadableRowWithItsReason) {
  segment(0, 5);
  replace(path(0), "8.010000", "8.01x000");
  EXPECT_THAT(faults_of_log(),
              ElementsAre(HasSubstr(": changed: 4 rows"),
                          HasSubstr(":" + std::to_string(line_of_row(path(0), 2)) +
                                    ": damaged: column rate_deg_per_h: found \"8.01x000\", expected a valid value")));
}

TEST_F(VerifyTest, ReportsASegmentThatDoesNotExist) {
  segment(0, 5);
  segment(10, 7);
  append(*writer(), kNoon + 20, 3);
  std::filesystem::remove(path(10));
  EXPECT_THAT(faults_of_log(), ElementsAre(name(0) + ": missing: the next 1 segment, with 7 rows"));
  std::filesystem::remove(path(0));
  const auto findings = verify({log})["findings"];
  EXPECT_EQ(text(findings.back(), "state"), "deleted");
  EXPECT_EQ(text(findings.back(), "text"),
            "begins with segment 3: 12 rows of the log are not here, before 2026-11-21T12:00:20Z");
}

TEST_F(VerifyTest, ReportsACaptureThatDoesNotExist) {
  for (const char* name : {"gyro1-000001-20261121T120000Z-0s.pcap", "gyro1-000004-20261121T120000Z-900s.pcap"})
    capture(name, 2);
  EXPECT_THAT(faults(folder.file("capture")),
              ElementsAre("gyro1-000001-20261121T120000Z-0s.pcap: missing: the next 2 segments"));
}

TEST_F(VerifyTest, ReportsADuplicateFileAndAnotherTable) {
  segment(0, 5);
  std::filesystem::copy_file(path(0), log + "/zcopy.csv");
  EXPECT_THAT(faults_of_log(), ElementsAre("zcopy.csv: doubled: identical to another file"));
  test::write_file(log + "/zcopy.csv", "a,b\n1,2\n");
  EXPECT_THAT(faults_of_log(), ElementsAre(StartsWith("zcopy.csv: refused: ")));
}

TEST_F(VerifyTest, ReportsLogsOfTwoGyrosInOneFolder) {
  segment(0, 2, "# gyro_serial: 70\n");
  segment(10, 2, "# gyro_serial: 71\n");
  EXPECT_THAT(faults_of_log(), ElementsAre(HasSubstr("found logs of gyro_serial \"70\"")));
}

TEST_F(VerifyTest, ReadsLogsOfVersion01AndFindsTheirTruncation) {
  EXPECT_THAT(faults(std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1"),
              ElementsAre(HasSubstr("torn: 3 rows, format 1, no end; 67 bytes of an incomplete row from line 16 on")));
}

TEST_F(VerifyTest, ReportsTheDamagedBytesOfACapture) {
  const std::string path = capture("gyro1-20261121T120000Z.pcap", 5);
  EXPECT_THAT(text(verify({path})["findings"][0], "text"),
              StartsWith("5 packets, 40 bytes of the line, opened 1 time, 2026-11-21T12:"));
  EXPECT_THAT(faults(path), IsEmpty());
  const std::string whole = test::content(path);
  cut(path, 7);
  EXPECT_THAT(faults(path), ElementsAre(AllOf(HasSubstr(": torn: 4 packets, 30 bytes"),
                                              HasSubstr("31 bytes from byte 166 on are not a complete packet"))));
  test::write_file(path, whole.substr(0, 128) + std::string(64, '\xFF') + whole.substr(128));
  EXPECT_THAT(faults(path), ElementsAre(AllOf(HasSubstr(": damaged: 5 packets, 40 bytes"),
                                              HasSubstr("64 bytes in 1 place from byte 128 on are not packets"))));
  test::write_file(path, whole.substr(0, 128) + std::string(64, '\xFF') + whole.substr(128, whole.size() - 135));
  EXPECT_THAT(faults(path),
              ElementsAre(AllOf(HasSubstr(": damaged: 4 packets, 30 bytes"),
                                HasSubstr("64 bytes in 1 place from byte 128 on are not packets; 31 bytes from "
                                          "byte 230 on are not a complete packet"))));
  test::write_file(path, "no capture");
  EXPECT_THAT(faults(path), ElementsAre(HasSubstr(": refused: not a pcap file")));
}

TEST_F(VerifyTest, PassesOverFilesOfOtherTypes) {
  const std::string config = std::string(PRISM_SOURCE_DIR) + "/config/examples/gyro1.json";
  EXPECT_THAT(faults(config), ElementsAre(HasSubstr("refused: found no log or capture; prismd --check checks models")));
  segment(0, 2);
  std::filesystem::copy_file(config, folder.file("gyro1.json"));
  EXPECT_THAT(faults(folder.file("")), IsEmpty());
  test::write_file(folder.file("table.csv"), "a,b\n1,2\n");
  EXPECT_THAT(faults(folder.file("table.csv")), ElementsAre(HasSubstr("refused: found no log or capture")));
}

TEST_F(VerifyTest, ReadsFoldersRecursively) {
  segment(0, 2);
  const std::string path = capture("gyro1-20261121T120000Z.pcap", 5);
  cut(path, 1);
  test::write_file(folder.file("notes.txt"), "mine");
  EXPECT_EQ(faults(folder.file("")).size(), 1u);
  EXPECT_EQ(verify({folder.file("")})["findings"].size(), 2u);
}

TEST_F(VerifyTest, ReportsAMissingPathAndAFolderWithoutPrismFiles) {
  EXPECT_THAT(faults(folder.file("none.csv")), ElementsAre(HasSubstr("refused: cannot be read: No such file")));
  EXPECT_THAT(faults(folder.file("none")), ElementsAre(HasSubstr("refused: cannot be read: No such file")));
  std::filesystem::create_directory(log);
  test::write_file(log + "/notes.txt", "mine");
  EXPECT_THAT(faults_of_log(), ElementsAre(HasSubstr("found no log")));
}

}  // namespace
}  // namespace prism::verification
