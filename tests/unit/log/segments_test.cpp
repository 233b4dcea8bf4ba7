// SPDX-License-Identifier: MIT
// Segments: names, rotation, retention, and errors of each file system call.
#include "daemon/log/segments.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/fsuid.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>

#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

constexpr std::int64_t kNoon = 1'795'262'400;  // 2026-11-21T12:00:00Z
constexpr std::int64_t kDay = 86400;
constexpr uid_t kNobody = 65534;

struct SegmentsTest : testing::Test {
  // A segment with a position and `rows` rows, of at least `bytes`. Returns its name, or the error.
  std::string made(Segments& segments, std::int64_t second = kNoon, std::size_t bytes = 0, std::uint64_t rows = 1) {
    const Result<NewSegment> segment = segments.make(second);
    if (!segment) return segment.error().text();
    std::string text = segments.position_line("# a: b\n");
    text.resize(std::max(text.size(), bytes), 'x');
    EXPECT_EQ(::write(segment->descriptor, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(segment->descriptor);
    segments.ended(rows);
    return segment->path.substr(settings.directory.size() + 1);
  }

  // Deletes without notice, on a clock of its own; events are in `events`.
  SegmentPolicy policy(std::int64_t notice_s = 0) {
    SegmentPolicy policy;
    policy.notice_s = notice_s;
    policy.uptime_s = [this] { return uptime_s; };
    policy.tell = [this](pipeline::Severity, const std::string& kind, const std::string& text) {
      events.push_back(kind + ": " + text);
    };
    return policy;
  }
  // Calls retain() once a second.
  void run(Segments& segments, std::int64_t seconds) {
    for (std::int64_t i = 0; i < seconds; ++i, ++uptime_s) segments.retain();
  }
  static const std::vector<StoredSegment>& begun(Segments& segments) {
    EXPECT_TRUE(segments.begin());
    return segments.stored();
  }
  std::string path(const std::string& file) const { return settings.directory + "/" + file; }

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
  std::int64_t uptime_s = 1000;
  std::vector<std::string> events;
};

TEST_F(SegmentsTest, AreNamedAfterTheirNumberAndTheirFirstSecond) {
  Segments segments(settings, "gyro", ".csv");
  EXPECT_EQ(made(segments), "gyro-000001-20261121T120000Z.csv");
  EXPECT_EQ(made(segments), "gyro-000002-20261121T120000Z.csv");
  EXPECT_EQ(made(segments, kNoon - 1), "gyro-000003-20261121T115959Z.csv");
  Segments again(settings, "gyro", ".csv");
  EXPECT_EQ(made(again), "gyro-000004-20261121T120000Z.csv");
}

TEST_F(SegmentsTest, ThatHadNoRowLeaveNoFileAndNoNumber) {
  Segments segments(settings, "gyro", ".csv");
  const Result<NewSegment> segment = segments.make(kNoon);
  ::close(segment->descriptor);
  segments.position_line("# a: b\n");
  segments.unmake();
  EXPECT_EQ(segments.id(), std::string(32, '0'));
  EXPECT_EQ(made(segments), "gyro-000001-20261121T120000Z.csv");
}

TEST_F(SegmentsTest, ACaptureHasItsRunningTimeInItsName) {
  for (const char* name : {"gyro-000001-20261121T120000Z-0s.pcap", "gyro-000002-20261121T120000Z-300s.pcap"}) {
    Segments segments(settings, "gyro", ".pcap", policy());
    const Result<NewSegment> segment = segments.make(kNoon);
    EXPECT_EQ(segment->path, path(name));
    const timespec written[2] = {{kNoon + 300, 0}, {kNoon + 300, 0}};
    ::futimens(segment->descriptor, written);
    ::close(segment->descriptor);
  }
}

TEST_F(SegmentsTest, CostTheSameHoweverManyThereAre) {
  Segments segments(settings, "gyro", ".csv", policy());
  made(segments);
  const long before = test::entries_read;
  for (int i = 1; i < 100; ++i) made(segments, kNoon + i);
  EXPECT_EQ(test::entries_read, before) << "no folder is read for a new segment";
  EXPECT_EQ(segments.stored().size(), 100u);
}

TEST_F(SegmentsTest, EndAtMultiplesOfTheirAgeAndBeforeTheyGrowTooLong) {
  settings.max_bytes = 1000;
  Segments segments(settings, "gyro", ".csv");
  EXPECT_TRUE(segments.begins_new(kNoon, 10)) << "the first";
  EXPECT_FALSE(segments.begins_new(kNoon + 1, 1000));
  EXPECT_TRUE(segments.begins_new(kNoon + 2, 1001));
  EXPECT_FALSE(segments.begins_new(kNoon + kDay / 2 - 1, 20));
  EXPECT_TRUE(segments.begins_new(kNoon + kDay / 2, 20)) << "midnight";
  EXPECT_TRUE(segments.begins_new(-1, 20)) << "before 1970";
  EXPECT_FALSE(segments.begins_new(-kDay, 20));
}

// The daemon may run as root, so it must not write to existing files or through links.
TEST_F(SegmentsTest, NeverWriteThroughALinkNorIntoAFileThatIsThere) {
  std::filesystem::create_directory(settings.directory);
  const std::string target = folder.file("other");
  std::filesystem::create_symlink(target, settings.directory + "/gyro-000001-20261121T120000Z.csv");
  test::write_file(path("gyro-000002-20261121T120000Z.csv"), "mine");
  Segments segments(settings, "gyro", ".csv");
  EXPECT_EQ(made(segments), "gyro-000003-20261121T120000Z.csv");
  EXPECT_FALSE(std::filesystem::exists(target));
  EXPECT_EQ(test::content(path("gyro-000002-20261121T120000Z.csv")), "mine");
}

// Earlier bug: a "name" of 250 letters passed the check, and std::filesystem::exists threw on the disk thread: SIGABRT.
TEST_F(SegmentsTest, ANameTooLongForTheFileSystemIsRefused) {
  Segments segments(settings, std::string(250, 'n'), ".csv");
  EXPECT_THAT(made(segments), EndsWith(".csv: cannot be created: File name too long"));
}

TEST_F(SegmentsTest, AFolderThatCannotBeMadeIsRefused) {
  test::write_file(settings.directory, "a file");
  Segments segments(settings, "gyro", ".csv");
  EXPECT_THAT(made(segments), HasSubstr("/log: cannot be created: Not a directory"));
  settings.directory += "/" + std::string(300, 'd');
  EXPECT_THAT(made(*std::make_unique<Segments>(settings, "gyro", ".csv")), HasSubstr("cannot be created"));
}

TEST_F(SegmentsTest, AFolderWithoutRightsIsRefused) {
  std::filesystem::create_directory(settings.directory);
  std::filesystem::permissions(settings.directory, std::filesystem::perms::owner_read);
  if (::geteuid() == 0) {  // root has all rights: this thread takes those of the user nobody (plain-ok: user name)
    std::filesystem::permissions(folder.file(""), std::filesystem::perms::all);
    std::filesystem::permissions(settings.directory, std::filesystem::perms::others_read);
    ::setfsuid(kNobody);
  }
  Segments segments(settings, "gyro", ".csv");
  EXPECT_THAT(made(segments), EndsWith("cannot be listed: Permission denied"));
  EXPECT_FALSE(segments.make_room());
  ::setfsuid(::geteuid());
  std::filesystem::permissions(settings.directory, std::filesystem::perms::owner_all);
}

TEST_F(SegmentsTest, TheOldestGoBeyondTheBytesThatAreKept) {
  settings.keep_bytes = 250;
  Segments segments(settings, "gyro", ".csv", policy());
  for (int i = 0; i < 5; ++i) made(segments, kNoon + i, 100);
  segments.retain();
  EXPECT_EQ(test::files_in(settings.directory).size(), 4U) << "one per call";
  run(segments, 3);
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-000004-20261121T120003Z.csv", "gyro-000005-20261121T120004Z.csv"));
  EXPECT_THAT(
      events,
      ElementsAre(
          "retention: log: deleted gyro-000001-20261121T120000Z.csv (1 row, 0.0 MiB): more than 0.0 MiB (log/keep_mib)",
          HasSubstr("gyro-000002-20261121T120001Z.csv"), HasSubstr("gyro-000003-20261121T120002Z.csv")));
}

// Earlier bug: after rows dated 1970 (a computer without a battery clock) came the right year, and the segment of this
// morning was deleted as 56 years old, without a message.
TEST_F(SegmentsTest, TheDateDoesNotMatter) {
  settings.keep_days = 1;
  Segments segments(settings, "gyro", ".csv", policy());
  made(segments, 100);
  run(segments, 100);
  made(segments, kNoon);
  run(segments, 100);
  made(segments, 200);
  run(segments, 100);
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-000001-19700101T000140Z.csv", "gyro-000002-20261121T120000Z.csv",
                          "gyro-000003-19700101T000320Z.csv"));
  EXPECT_THAT(events, testing::IsEmpty());
  run(segments, kDay);
  EXPECT_THAT(test::files_in(settings.directory), ElementsAre("gyro-000003-19700101T000320Z.csv"))
      << "the newest stays";
  EXPECT_THAT(events.front(), HasSubstr("written more than 1 day ago, as prismd measured (log/keep_days)"));
}

// The age counts the time that prismd runs, over its runs: a row a second.
TEST_F(SegmentsTest, AgeGrowsOverRunsAndNotBetweenThem) {
  settings.keep_days = 1;
  for (int hours = 0; hours < 30; hours += 5) {
    Segments segments(settings, "gyro", ".csv", policy());
    segments.retain();
    made(segments, kNoon + hours, 0, 5 * 3600);
    std::ofstream(segments.stored().back().path, std::ios::app) << "# end: rows 18000, sha256 0\n";
    run(segments, 5 * 3600);
    EXPECT_EQ(test::files_in(settings.directory).front(),
              hours < 25 ? "gyro-000001-20261121T120000Z.csv" : "gyro-000002-20261121T120005Z.csv")
        << hours;
    uptime_s = hours;  // the machine restarted, a year later
  }
}

TEST_F(SegmentsTest, ADeletionIsAnnouncedBeforeAndReportedAfter) {
  settings.keep_days = 1;
  Segments segments(settings, "gyro", ".csv", policy(60));
  made(segments, kNoon, 1000, 7);
  made(segments, kNoon + 1, 100);
  segments.retain();
  auto status = segments.retention();
  ASSERT_TRUE(status && status->next);
  EXPECT_EQ(status->next->file, "gyro-000001-20261121T120000Z.csv");
  EXPECT_EQ(status->next->rows, 7u);
  EXPECT_EQ(status->next->bytes, 1000);
  EXPECT_EQ(status->next->why, NextDeletion::Why::kAge);
  EXPECT_EQ(status->next->in_s, kDay + 60);
  EXPECT_EQ(status->segments, 2u);
  EXPECT_EQ(status->bytes, 1100);
  run(segments, kDay + 30);
  status = segments.retention();
  EXPECT_EQ(test::files_in(settings.directory).size(), 2u);
  EXPECT_LE(status->next->in_s, 60);
  run(segments, 40);
  status = segments.retention();
  EXPECT_EQ(test::files_in(settings.directory).size(), 1u);
  EXPECT_EQ(status->deleted_segments, 1u);
  EXPECT_EQ(status->deleted_rows, 7u);
  EXPECT_THAT(events, ElementsAre(HasSubstr("deleted gyro-000001-20261121T120000Z.csv (7 rows, 0.0 MiB)")));
  Segments again(settings, "gyro", ".csv");
  EXPECT_EQ(begun(again).front().number, 2u);
}

TEST_F(SegmentsTest, TheTimeOfADeletionByBytesIsExpectedFromTheGrowth) {
  settings.keep_bytes = 2000;
  Segments segments(settings, "gyro", ".csv", policy());
  made(segments, kNoon, 500);
  const std::string open = path(made(segments, kNoon + 1));
  segments.retain();
  uptime_s += 100;
  const auto grown = test::content(open) + std::string(500, 'x');  // 5 bytes/s
  test::write_file(open, grown);
  segments.retain();
  const auto status = segments.retention();
  ASSERT_TRUE(status->next->in_s);
  EXPECT_EQ(status->next->why, NextDeletion::Why::kBytes);
  EXPECT_EQ(status->next->in_s, (2000 - 500 - static_cast<std::int64_t>(grown.size())) / 5 + 1);
}

// Two prismd with one directory: neither deletes a segment that the other writes.
TEST_F(SegmentsTest, ASegmentThatAnotherProcessWritesStays) {
  settings.keep_bytes = 1;
  settings.delete_when_full = true;
  std::filesystem::create_directory(settings.directory);
  const std::string its = path("gyro-000001-20261121T120000Z.csv");
  test::write_file(its, "text");
  const int other = ::open(its.c_str(), O_RDONLY);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  Segments segments(settings, "gyro", ".csv", policy());
  run(segments, 200);
  EXPECT_FALSE(segments.make_room());
  EXPECT_EQ(test::files_in(settings.directory).size(), 1u);
  ::close(other);
  run(segments, 100);
  EXPECT_EQ(test::files_in(settings.directory).size(), 0u);
}

TEST_F(SegmentsTest, AReplayDeletesNothing) {
  settings.keep_bytes = 1;
  settings.keep_days = 1;
  settings.delete_when_full = true;
  SegmentPolicy replay = policy();
  replay.deletes = false;
  Segments segments(settings, "gyro", ".csv", replay);
  for (int day = 0; day < 5; ++day) made(segments, kNoon + day * kDay);
  run(segments, 2 * kDay);
  EXPECT_FALSE(segments.make_room());
  EXPECT_EQ(test::files_in(settings.directory).size(), 5u);
}

// A damaged running time must not make segments old.
TEST_F(SegmentsTest, ADamagedClockMakesNoSegmentOld) {
  settings.keep_days = 100;
  for (const char* damage : {"900000000000000", "-5", "x"}) {
    std::filesystem::remove_all(settings.directory);
    {
      Segments segments(settings, "gyro", ".csv", policy());
      for (int i = 0; i < 3; ++i) made(segments, kNoon + i);
    }
    const std::string newest = path("gyro-000003-20261121T120002Z.csv");
    const std::string text = test::content(newest);
    test::write_file(newest, text.substr(0, text.find("running ") + 8) + damage + "\n");
    Segments segments(settings, "gyro", ".csv", policy());
    made(segments, kNoon + 4);
    run(segments, 3600);
    EXPECT_EQ(test::files_in(settings.directory).size(), 4u) << damage;
  }
}

// 0.3: the order of the index, then of the names; both continue with the next number and row.
TEST_F(SegmentsTest, ThoseOf03HaveTheNumbersOfTheirIndex) {
  settings.delete_when_full = true;
  std::filesystem::create_directory(settings.directory);
  const std::string head = "# a: b\n", rows = "time\n1\n2\n3\n", id(32, 'f');
  test::write_file(path("gyro-20261121T120009Z.csv"), head + rows);
  test::write_file(path("gyro-20261121T120001Z.csv"),
                   head + "# supersedes: gyro-20261121T120009Z.csv from row 3\n" + rows);
  test::write_file(path("gyro-20261121T120000Z-2.csv"), head + rows);
  test::write_file(path("gyro-20261121T120000Z-10.csv"), head + rows);
  test::write_file(path("gyro.csv.index"),
                   "{\"format\":\"prism-segments\",\"version\":1,\"id\":\"" + id +
                       "\",\"next\":4,\"deleted_segments\":3,\"deleted_rows\":100,\"clock_s\":50}\n"
                       "{\"made\":4,\"file\":\"gyro-20261121T120009Z.csv\",\"rows\":3,\"clock_s\":60}\n"
                       "{\"made\":5,\"file\":\"removed.csv\",\"rows\":40}\n"
                       "{\"made\":6,\"file\":\"gyro-20261121T120001Z.csv\",\"clock_s\":70}\n");
  for (const std::size_t later : {0, 1}) {
    Segments segments(settings, "gyro", ".csv", policy());
    std::vector<std::string> found;
    for (std::size_t i = 0; i < begun(segments).size(); ++i)
      found.push_back(
          fmt::format("{} {} {}", segments.stored()[i].number, segments.first(i), segments.stored()[i].file));
    found.resize(4);
    EXPECT_THAT(found, ElementsAre("4 101 gyro-20261121T120009Z.csv", "6 143 gyro-20261121T120001Z.csv",
                                   "7 146 gyro-20261121T120000Z-2.csv", "8 149 gyro-20261121T120000Z-10.csv"));
    EXPECT_EQ(segments.id(), id);
    EXPECT_EQ(segments.end(), 151 + later);
    if (later > 0) continue;
    const std::string newer = made(segments);
    EXPECT_EQ(newer, "gyro-000009-20261121T120000Z.csv");
    std::ofstream(path(newer), std::ios::app) << rows.substr(0, 7);
    EXPECT_THAT(test::content(path(newer)), HasSubstr("# log: " + id + " segment 9 first 152 running 70\n"));
  }
  // Without the index, the first newer segment has the row after them; the index is deleted with the last of them.
  std::filesystem::remove(path("gyro-20261121T120009Z.csv"));
  std::filesystem::rename(path("gyro.csv.index"), path("index"));
  {
    Segments segments(settings, "gyro", ".csv", policy());
    EXPECT_EQ(begun(segments).front().number, 6u);
    EXPECT_EQ(segments.first(0), 143u);
  }
  std::filesystem::rename(path("index"), path("gyro.csv.index"));
  Segments segments(settings, "gyro", ".csv", policy());
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(std::filesystem::exists(path("gyro.csv.index")));
    EXPECT_TRUE(segments.make_room());
  }
  EXPECT_FALSE(std::filesystem::exists(path("gyro.csv.index")));
}

TEST_F(SegmentsTest, OtherFilesAreNobodysToDelete) {
  settings.keep_bytes = 0;
  std::filesystem::create_directory(settings.directory);
  const std::vector<std::string> others = {"gyro-20200101T000000Z.pcap",
                                           "gyro-2-20200101T000000Z.csv",
                                           "gyro-2020.csv",
                                           "gyro.csv",
                                           "gyro-notes-of-the-day.csv",
                                           "other.txt"};
  for (const std::string& other : others) test::write_file(settings.directory + "/" + other, "kept");
  Segments segments(settings, "gyro", ".csv", policy());
  const std::string mine = made(segments);
  run(segments, 10);
  EXPECT_EQ(test::files_in(settings.directory).size(), others.size() + 1);
}

TEST_F(SegmentsTest, RoomIsMadeOnlyWhereTheConfigurationSaysSoAndNeverOfTheCurrentOne) {
  Segments stops(settings, "gyro", ".csv");
  made(stops);
  made(stops, kNoon + 1);
  EXPECT_FALSE(stops.make_room());
  settings.delete_when_full = true;
  Segments deletes(settings, "gyro", ".csv");
  made(deletes, kNoon + 2);
  EXPECT_TRUE(deletes.make_room());
  EXPECT_TRUE(deletes.make_room());
  EXPECT_FALSE(deletes.make_room());
  EXPECT_THAT(test::files_in(settings.directory), ElementsAre("gyro-000003-20261121T120002Z.csv"));
}

// A range-for over a directory throws if the disk fails. Files that cannot be listed are not deleted.
TEST_F(SegmentsTest, AFolderThatCannotBeReadToItsEndThrowsNothing) {
  settings.keep_bytes = 0;
  settings.delete_when_full = true;
  Segments segments(settings, "gyro", ".csv", policy());
  for (int i = 0; i < 3; ++i) made(segments, kNoon);
  for (int entries = 0; entries < 6; ++entries) {
    const test::FailingCall fault(test::failing_readdir, EIO);
    test::readable_entries = entries;
    made(segments, kNoon + entries);
    run(segments, 5);
    test::readable_entries = entries;
    segments.make_room();
  }
  EXPECT_THAT(test::files_in(settings.directory), testing::Contains(EndsWith("-20261121T120005Z.csv")));
}

TEST_F(SegmentsTest, KnowWhetherTheirFileIsStillThere) {
  Segments segments(settings, "gyro", ".csv");
  const Result<NewSegment> segment = segments.make(kNoon);
  ASSERT_TRUE(segment);
  EXPECT_TRUE(segments.in_place(segment->descriptor));
  std::filesystem::rename(settings.directory, folder.file("moved"));
  EXPECT_FALSE(segments.in_place(segment->descriptor));
  std::filesystem::create_directory(settings.directory);
  test::write_file(segment->path, "another of this name");
  EXPECT_FALSE(segments.in_place(segment->descriptor));
  ::close(segment->descriptor);
}

}  // namespace
}  // namespace prism::log
