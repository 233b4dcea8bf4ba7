// SPDX-License-Identifier: MIT
// Logs with restarts, kills, clock steps and disk errors: each second of a session is used once.
#include "tools/prismcal/log_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "base/sha256.hpp"
#include "compensation/compensated_text.hpp"
#include "tests/support/collected.hpp"
#include "tests/support/document.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kNoon = 1'795'262'400;

/// Rows whose seconds end at first, first + 1, …. `partial`: 1 marks the first, 2 the last, 3 both.
std::string rows_of(std::int64_t first, int count, int partial = 0) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    compensation::CompensatedWindow row;
    row.window.second_mean = {first + i - 1, 10, 0, 8.0 + 0.01 * (i % 7), 25.0 + 0.001 * i, 5.25, 0, false};
    row.window.second_mean.partial = (i == 0 && (partial & 1)) || (i == count - 1 && (partial & 2));
    compensation::append_csv(text, row);
  }
  return text;
}

struct LogTable {
  std::vector<LogRow> rows;
  std::vector<std::size_t> sessions;  ///< index of the first row of each
  LeftOut left_out;
};

LogTable all_rows(LogFolder& folder) {
  LogTable table;
  auto left_out = join_rows(folder, [&](const LogRow& row, bool begins_session) {
    if (begins_session) table.sessions.push_back(table.rows.size());
    table.rows.push_back(row);
    return Result<void>();
  });
  EXPECT_TRUE(left_out) << left_out.error().text();
  if (left_out) table.left_out = std::move(*left_out);
  return table;
}

struct LogFolderTest : testing::Test {
  const test::TemporaryFolder folder;
  const std::string log = folder.file("log");

  void SetUp() override { std::filesystem::create_directory(log); }

  static std::string head(const std::string& session, const std::string& more = "") {
    return "# prism 0.2.0 data log, format 2\n# instance: gyro1\n# gyro_serial: 70\n" + more + "# session: " + session +
           "\n" + std::string(compensation::csv_columns()) + "\n";
  }
  static std::string end(const std::string& text, std::size_t rows) {
    return fmt::format("# end: rows {}, sha256 {}\n", rows, sha256_hex(text));
  }
  void write(const std::string& file, const std::string& text) const {
    std::ofstream(log + "/" + file, std::ios::binary) << text;
  }
  void write_closed(const std::string& file, const std::string& text, std::size_t rows) const {
    write(file, text + end(text, rows));
  }
  LogTable joined() const {
    auto read = LogFolder::open(log);
    EXPECT_TRUE(read) << read.error().text();
    return read ? all_rows(*read) : LogTable();
  }
  std::string error_text() const {
    const auto read = LogFolder::open(log);
    return read ? "no error" : read.error().text();
  }
};

std::vector<std::int64_t> ends_of(const LogTable& rows) {
  std::vector<std::int64_t> seconds;
  for (const LogRow& row : rows.rows) seconds.push_back(row.second_mean.second + 1 - kNoon);
  return seconds;
}

TEST_F(LogFolderTest, KeepsBothPartsOfASecondAfterARestart) {
  write_closed("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3, 2), 3);
  write_closed("gyro1-20261121T120002Z.csv", head("2026-11-21T12:00:01.8Z") + rows_of(kNoon + 2, 3, 1), 3);
  const LogTable rows = joined();
  EXPECT_THAT(ends_of(rows), ElementsAre(0, 1, 2, 2, 3, 4));
  EXPECT_THAT(rows.sessions, ElementsAre(0u, 3u));
  EXPECT_EQ(rows.left_out.partial, 2u);
  EXPECT_THAT(rows.left_out.lines(),
              ElementsAre(HasSubstr("2 seconds not used: partial, at the start or end of a session")));
}

// A session continues over midnight and over a reload: the window does not restart.
TEST_F(LogFolderTest, JoinsSegmentsOfTheSameSession) {
  write_closed("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3), 3);
  write_closed("gyro1-20261121T120003Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon + 3, 3), 3);
  EXPECT_THAT(joined().sessions, ElementsAre(0u));
  EXPECT_THAT(joined().left_out.lines(), IsEmpty());
}

// A regression: after the host clock was set back by an hour, new segments were sorted before the older ones.
TEST_F(LogFolderTest, OrdersSegmentsByTheIndexNotByTime) {
  write_closed("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 2), 2);
  write_closed("gyro1-20261121T110000Z.csv", head("2026-11-21T10:59:59.5Z") + rows_of(kNoon - 3600, 2), 2);
  EXPECT_THAT(ends_of(joined()), ElementsAre(-3600, -3599, 0, 1));
  write("gyro1.csv.index",
        "{\"format\":\"prism-segments\",\"version\":1,\"id\":\"00\"}\n"
        "{\"made\":1,\"file\":\"gyro1-20261121T120000Z.csv\"}\n{\"made\":2,\"file\":\"gyro1-20261121T110000Z.csv\"}\n");
  EXPECT_THAT(ends_of(joined()), ElementsAre(0, 1, -3600, -3599));
  EXPECT_THAT(joined().sessions, ElementsAre(0u, 2u));
}

TEST_F(LogFolderTest, OrdersSegmentsByTheirPosition) {
  const auto at = [](int segment, int first) {
    return fmt::format("# log: {:032x} segment {} first {} running 0\n", 1, segment, first);
  };
  write_closed("a.csv", head("2026-11-21T10:59:59.5Z", at(12, 103)) + rows_of(kNoon - 3600, 2), 2);
  write_closed("b.csv", head("2026-11-21T11:59:59.5Z", at(3, 101)) + rows_of(kNoon, 2), 2);
  EXPECT_THAT(ends_of(joined()), ElementsAre(0, 1, -3600, -3599));
  EXPECT_THAT(LogFolder::open(log)->absent,
              ElementsAre("begins with segment 3: 100 rows of the log are not here, before 2026-11-21T12:00:00Z"));
  write("c.csv", head("2026-11-21T12:59:59.5Z", "# log: 1 segment 1\n") + rows_of(kNoon, 2));
  EXPECT_THAT(LogFolder::open(log)->rejected.front().second.text(),
              HasSubstr("log: found \"1 segment 1\", expected ID segment N first ROW running S"));
}

TEST_F(LogFolderTest, UsesEqualSecondsOfTwoSessions) {
  write_closed("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 50), 50);
  write_closed("gyro1-20261121T120000Z-2.csv", head("2026-11-21T12:00:49.5Z") + rows_of(kNoon, 50), 50);
  const auto recording = test::collected(log);
  ASSERT_TRUE(recording) << recording.error().text();
  compensation::FeatureDefinition features;
  features.length_s = features.end_mean_s = 5;
  const auto table = make_block_table(recording->second_means, features, 0, "log", recording->sessions);
  ASSERT_TRUE(table) << table.error().text();
  EXPECT_EQ(table->size(), 2u * 9) << "per session a window of 10 s, then a block every 5 s";
  std::vector<std::int64_t> seconds;
  for_each_known(table->seconds, [&](std::int64_t second, double) { seconds.push_back(second); });
  EXPECT_TRUE(std::is_sorted(seconds.begin(), seconds.end()));
  EXPECT_EQ(table->gaps, 1u);
}

TEST_F(LogFolderTest, SkipsPartialSecondsInBlocks) {
  write_closed("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 12, 3), 12);
  const auto recording = test::collected(log);
  compensation::FeatureDefinition features;
  features.length_s = features.end_mean_s = 5;
  const auto table = make_block_table(recording->second_means, features, 0, "log", recording->sessions);
  ASSERT_TRUE(table) << table.error().text();
  EXPECT_EQ(table->size(), 1u);
  EXPECT_EQ(table->seconds.at(0).values.size(), 10u);
}

TEST_F(LogFolderTest, UsesDuplicateDataOnce) {
  const std::string text = head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 4);
  write_closed("gyro1-20261121T120000Z.csv", text, 4);
  write_closed("copy of gyro1-20261121T120000Z.csv", text, 4);
  write("half of gyro1.csv", head("2026-11-21T11:59:59.5Z", "# note: mine\n") + rows_of(kNoon + 2, 1));
  const LogTable rows = joined();
  EXPECT_THAT(ends_of(rows), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(rows.left_out.copies, 1u);
  EXPECT_EQ(rows.left_out.duplicates, 1u);
}

TEST_F(LogFolderTest, UsesASupersededRowOnlyFromTheLaterSegment) {
  const std::string session = "2026-11-21T11:59:59.5Z";
  write("gyro1-20261121T120000Z.csv", head(session) + rows_of(kNoon, 5));
  write_closed("gyro1-20261121T120003Z.csv",
               head(session, "# supersedes: gyro1-20261121T120000Z.csv from row 4\n") + rows_of(kNoon + 3, 4), 4);
  const LogTable rows = joined();
  EXPECT_THAT(ends_of(rows), ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_EQ(rows.left_out.superseded, 2u);
  EXPECT_EQ(rows.left_out.duplicates, 0u);
}

// Truncated at every byte, as after a kill or power failure: at most the last row is lost, and the folder stays
// readable.
TEST_F(LogFolderTest, ATruncatedSegmentLosesOnlyItsLastRow) {
  const std::string body = head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3);
  const std::string text = body + end(body, 3);
  for (std::size_t length = 0; length <= text.size(); ++length) {
    write("gyro1-20261121T120000Z.csv", text.substr(0, length));
    auto segment = open_log_segment(log + "/gyro1-20261121T120000Z.csv");
    ASSERT_TRUE(segment) << length << ": " << segment.error().text();
    ASSERT_TRUE(read_log_segment(*segment, {}));
    EXPECT_EQ(segment->end, length == text.size() ? SegmentEnd::kIntact : SegmentEnd::kTruncated) << length;
    const std::string left = text.substr(0, length);
    const std::string lines = left.substr(0, left.rfind('\n') + 1);
    const auto rows = std::count(lines.begin(), lines.end(), '\n') - std::count(lines.begin(), lines.end(), '#');
    EXPECT_EQ(segment->rows, std::max<std::ptrdiff_t>(rows - 1, 0)) << length;
    const bool headless = length < head("2026-11-21T11:59:59.5Z").size();  // then it has no rows
    EXPECT_EQ(segment->truncated_bytes, headless ? length : left.size() - (left.rfind('\n') + 1)) << length;
  }
}

// Some without rows, one damaged, one longer than a piece that is read at once.
TEST_F(LogFolderTest, JoinsManySegmentsInOrder) {
  int expected = 0;
  for (int i = 0; i < 40; ++i) {
    const std::string session = fmt::format("2026-11-{:02}T11:59:59.5Z", 1 + i / 2);
    const int rows = i == 7 ? 9000 : i % 5;
    const std::string text = head(session) + rows_of(kNoon + 10'000 * i, rows);
    write_closed(fmt::format("gyro1-202611{:02}T120000Z{}.csv", 1 + i / 2, i % 2 ? "-2" : ""),
                 i == 20 ? text + "x\n" : text, static_cast<std::size_t>(rows));
    expected += rows;
  }
  const LogTable rows = joined();
  EXPECT_EQ(rows.rows.size(), static_cast<std::size_t>(expected));
  const auto seconds = ends_of(rows);
  EXPECT_TRUE(std::is_sorted(seconds.begin(), seconds.end()));
  EXPECT_EQ(rows.left_out.changed.size() + rows.left_out.damaged.size(), 1u);
}

// ext4 can leave zeroes after the last sync.
TEST_F(LogFolderTest, TreatsZeroesAtTheEndAsTruncation) {
  write("gyro1-20261121T120000Z.csv",
        head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3) + std::string(50, '\0') + "\n" + std::string(50, '\0'));
  EXPECT_EQ(joined().rows.size(), 3u);
  EXPECT_EQ(joined().left_out.truncated_bytes, 101u);
  write("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3) + std::string(3 << 20, '\0'));
  EXPECT_EQ(joined().rows.size(), 3u);
  EXPECT_EQ(joined().left_out.truncated_bytes, 3u << 20);
}

TEST_F(LogFolderTest, ADamagedRowOrFileAffectsOnlyItself) {
  write("gyro1-20261121T120000Z.csv",
        head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 2) + "x\n" + rows_of(kNoon + 2, 2));
  write("gyro1-20261121T120100Z.csv", "a,b\n1,2\n");
  EXPECT_EQ(joined().rows.size(), 4u);
  EXPECT_THAT(joined().left_out.lines(),
              testing::IsSupersetOf({HasSubstr("000Z.csv:8: found 1 columns, expected 22; 1 row not used"),
                                     HasSubstr("100Z.csv:1: not a log of prismd")}));
}

TEST_F(LogFolderTest, SalvageReadsAllGoodRows) {
  write("gyro1-20261121T120000Z.csv",
        head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 2) + "x\n" + rows_of(kNoon + 2, 2));
  write("table.csv", "a,b\n1,2\n");
  auto salvaged = LogFolder::salvage(log);
  ASSERT_EQ(salvaged.segments.size(), 1u);
  const LogTable rows = all_rows(salvaged);
  EXPECT_THAT(ends_of(rows), ElementsAre(0, 1, 2, 3));
  ASSERT_EQ(salvaged.segments[0].damaged.size(), 1u);
  EXPECT_EQ(salvaged.segments[0].damaged[0].line, 8u);
  EXPECT_EQ(salvaged.segments[0].damaged[0].why, "found 1 columns, expected 22");
  EXPECT_EQ(rows.rows[2].number, 4u) << "counts the damaged row, as end lines and superseding segments do";
  ASSERT_EQ(salvaged.rejected.size(), 1u);
  EXPECT_EQ(salvaged.rejected[0].first, log + "/table.csv");
}

TEST_F(LogFolderTest, UsesAChangedSegmentAndReportsIt) {
  const std::string text = head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3);
  std::string changed = text + end(text, 3);
  changed.replace(changed.find("8.010000"), 8, "8.910000");
  write("gyro1-20261121T120000Z.csv", changed);
  EXPECT_EQ(joined().rows.size(), 3u);
  EXPECT_THAT(joined().left_out.lines(), ElementsAre(HasSubstr("does not match its end line")));
}

TEST_F(LogFolderTest, ALockedSegmentIsOpenNotTruncated) {
  write("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 3));
  const int writer = ::open((log + "/gyro1-20261121T120000Z.csv").c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(writer, LOCK_EX), 0);
  EXPECT_EQ(joined().left_out.truncated.size(), 0u);
  EXPECT_EQ(joined().rows.size(), 3u);
  ::close(writer);
  EXPECT_EQ(joined().left_out.truncated.size(), 1u);
}

// A row does not contain which value was implausible, so no value of it is used.
TEST_F(LogFolderTest, SkipsAndReportsImplausibleSeconds) {
  std::string rows;
  for (int i = 0; i < 4; ++i) {
    compensation::CompensatedWindow row;
    row.window.second_mean = {kNoon + i - 1, 10, 0, 8.0 + i, i < 2 ? -273.0 : 25.0, 5.25};
    row.correction.quality = compensation::kNoModel | (i < 2 ? compensation::kImplausible : compensation::kGood);
    compensation::append_csv(rows, row);
  }
  write("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows);
  const LogTable read = joined();
  ASSERT_EQ(read.rows.size(), 4u);
  EXPECT_EQ(read.left_out.implausible, 2u);
  EXPECT_THAT(read.left_out.lines(), testing::Contains(HasSubstr("2 seconds not used: implausible values")));
  const auto series = read_rate_series(log, {});
  ASSERT_TRUE(series) << series.error().text();
  EXPECT_THAT(series->rate_deg_per_h, ElementsAre(10, 11));
}

TEST_F(LogFolderTest, RejectsTwoGyrosAndANewerFormat) {
  write("gyro1-20261121T120000Z.csv", head("2026-11-21T11:59:59.5Z") + rows_of(kNoon, 2));
  std::string other = head("2026-11-21T12:00:59.5Z") + rows_of(kNoon + 60, 2);
  other.replace(other.find("serial: 70"), 10, "serial: 71");
  write("gyro1-20261121T120100Z.csv", other);
  EXPECT_THAT(error_text(), HasSubstr("found logs of gyro_serial \"70\""));
  other.replace(other.find("serial: 71"), 10, std::string("serial: \x1b\0", 10));
  write("gyro1-20261121T120100Z.csv", other);
  const auto damage = [this] { return joined().left_out.damaged; };
  EXPECT_THAT(damage(), ElementsAre(HasSubstr("120100Z.csv:3: found \"# gyro_serial: \\x1b\\x00\", expected")))
      << "bytes of a damaged disk must not reach the terminal";
  write("gyro1-20261121T120100Z.csv", "# prism 9 data log, format 3\ntime_utc\n");
  EXPECT_THAT(damage(), ElementsAre(HasSubstr("found format 3 of a newer prism, expected 1 or 2; file not used")));
}

TEST_F(LogFolderTest, DescribesAFolderWithoutALog) {
  const std::string none =
      ": found no .csv in the folder, expected prismd's log; give a capture by its own path, with --config";
  EXPECT_EQ(LogFolder::open(log).error().text(), log + none);
  write("z.pcap", "\xd4\xc3\xb2\xa1");
  EXPECT_EQ(LogFolder::open(log).error().text(), log + none);
}

// Written by prismd 0.1: five runs, three restarts within a second, two kills, and a last row truncated by a power
// failure.
TEST(Format1, AFolderOfVersion01IsReadable) {
  const std::string path = std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1";
  const auto recording = test::collected(path);
  ASSERT_TRUE(recording) << recording.error().text();
  EXPECT_EQ(recording->second_means.size(), 61u);
  EXPECT_THAT(recording->sessions, ElementsAre(0u, 25u, 32u, 58u));
  EXPECT_THAT(recording->remarks(), ElementsAre(HasSubstr("1 segment without an end")));
  EXPECT_EQ(recording->value("gyro_serial"), "70-0042");
  compensation::FeatureDefinition features;
  features.length_s = 5;
  features.end_mean_s = 2;
  const auto table = make_block_table(recording->second_means, features, 0, "log", recording->sessions);
  ASSERT_TRUE(table) << table.error().text();
  EXPECT_EQ(table->first_s + 1, 1'795'320'783);
}

TEST(Format1, IsReadableAsARateSeries) {
  RateSeriesChoice choice;
  choice.column = "mean_rate_deg_per_h";
  const auto series = read_rate_series(std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1", choice);
  ASSERT_TRUE(series) << series.error().text();
  EXPECT_EQ(series->rows, 61u);
  EXPECT_EQ(series->interval_s, 1);
  EXPECT_EQ(series->rate_deg_per_h.size(), 64u) << "a gap between two sessions";
  EXPECT_FALSE(series->notes.empty());
  choice.column = "no_such";
  EXPECT_THAT(read_rate_series(std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1", choice).error().text(),
              HasSubstr("found no column \"no_such\", expected one of time_utc"));
}

}  // namespace
}  // namespace prism::recordings
