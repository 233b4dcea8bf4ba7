// SPDX-License-Identifier: MIT
// Segments: names, rotation, retention, and errors of each file system call.
#include "daemon/log/segments.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/fsuid.h>
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
  // Returns the name of the new segment, or the error.
  std::string made(Segments& segments, std::int64_t second = kNoon, const std::string& text = "") {
    const Result<NewSegment> segment = segments.make(second);
    if (!segment) return segment.error().text();
    EXPECT_EQ(::write(segment->descriptor, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(segment->descriptor);
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
  std::string index() const { return test::content(settings.directory + "/gyro.csv.index"); }

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
  std::int64_t uptime_s = 1000;
  std::vector<std::string> events;
};

TEST_F(SegmentsTest, AreNamedAfterTheirFirstSecondAndNumberedWithinIt) {
  Segments segments(settings, "gyro", ".csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z.csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z-2.csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z-3.csv");
  EXPECT_EQ(made(segments, kNoon + 1), "gyro-20261121T120001Z.csv");
}

TEST_F(SegmentsTest, CostTheSameHoweverManyThereAre) {
  Segments segments(settings, "gyro", ".csv", policy());
  made(segments);
  const long before = test::entries_read;
  for (int i = 1; i < 100; ++i) made(segments, kNoon + i);
  EXPECT_EQ(test::entries_read, before) << "no folder is read for a new segment";
  EXPECT_EQ(segments.numbered().size(), 100u);
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
  std::filesystem::create_symlink(target, settings.directory + "/gyro-20261121T120000Z.csv");
  test::write_file(settings.directory + "/gyro-20261121T120000Z-2.csv", "mine");
  Segments segments(settings, "gyro", ".csv");
  EXPECT_EQ(made(segments, kNoon, "text"), "gyro-20261121T120000Z-3.csv");
  EXPECT_FALSE(std::filesystem::exists(target));
  EXPECT_EQ(test::content(settings.directory + "/gyro-20261121T120000Z-2.csv"), "mine");
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
  EXPECT_THAT(made(segments), EndsWith("cannot be created: Permission denied"));
  EXPECT_FALSE(segments.make_room());
  ::setfsuid(::geteuid());
  std::filesystem::permissions(settings.directory, std::filesystem::perms::owner_all);
}

TEST_F(SegmentsTest, TheOldestGoBeyondTheBytesThatAreKept) {
  settings.keep_bytes = 250;
  Segments segments(settings, "gyro", ".csv", policy());
  for (int i = 0; i < 5; ++i) made(segments, kNoon + i, std::string(100, 'x'));
  segments.retain();
  EXPECT_EQ(test::files_in(settings.directory).size(), 4U) << "one per call";
  run(segments, 3);
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-20261121T120003Z.csv", "gyro-20261121T120004Z.csv"));
  EXPECT_THAT(
      events,
      ElementsAre("retention: log: deleted gyro-20261121T120000Z.csv (0.0 MiB): more than 0.0 MiB (log/keep_mib)",
                  HasSubstr("gyro-20261121T120001Z.csv"), HasSubstr("gyro-20261121T120002Z.csv")));
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
              ElementsAre("gyro-19700101T000140Z.csv", "gyro-19700101T000320Z.csv", "gyro-20261121T120000Z.csv"));
  EXPECT_THAT(events, testing::IsEmpty());
  run(segments, kDay);
  EXPECT_THAT(test::files_in(settings.directory), ElementsAre("gyro-19700101T000320Z.csv")) << "the newest stays";
  EXPECT_THAT(events.front(), HasSubstr("written more than 1 day ago, as prismd measured (log/keep_days)"));
}

// The age counts the time that prismd runs, over its runs, from the end of the segment.
TEST_F(SegmentsTest, AgeGrowsOverRunsAndNotBetweenThem) {
  settings.keep_days = 1;
  for (int hours = 0; hours < 30; hours += 5) {
    Segments segments(settings, "gyro", ".csv", policy());
    segments.retain();
    made(segments, kNoon + hours);
    run(segments, 5 * 3600);
    segments.ended(10);
    EXPECT_EQ(test::files_in(settings.directory).front(),
              hours < 25 ? "gyro-20261121T120000Z.csv" : "gyro-20261121T120005Z.csv")
        << hours;
    uptime_s = hours;  // the machine restarted, a year later
  }
}

// Segments of version 0.2 have no age in the index: it begins when they are seen first.
TEST_F(SegmentsTest, SegmentsOfUnknownAgeAreYoung) {
  settings.keep_days = 1;
  std::filesystem::create_directory(settings.directory);
  for (const char* name : {"gyro-20200101T000000Z.csv", "gyro-20200102T000000Z.csv"})
    test::write_file(settings.directory + "/" + name, "1\n");
  test::write_file(
      settings.directory + "/gyro.csv.index",
      "{\"format\":\"prism-segments\",\"version\":1,\"id\":\"0123456789abcdef0123456789abcdef\",\"next\":1,"
      "\"deleted_segments\":0,\"deleted_rows\":0}\n{\"made\":1,\"file\":\"gyro-20200101T000000Z.csv\",\"rows\":1}\n");
  Segments segments(settings, "gyro", ".csv", policy());
  run(segments, kDay - 100);
  EXPECT_EQ(test::files_in(settings.directory).size(), 2u);
  run(segments, 200);
  EXPECT_THAT(test::files_in(settings.directory), testing::IsEmpty());
}

TEST_F(SegmentsTest, ADeletionIsAnnouncedBeforeAndReportedAfter) {
  settings.keep_days = 1;
  Segments segments(settings, "gyro", ".csv", policy(60));
  made(segments, kNoon, std::string(1000, 'x'));
  segments.ended(7);
  made(segments, kNoon + 1, std::string(100, 'x'));
  segments.retain();
  auto status = segments.retention();
  ASSERT_TRUE(status && status->next);
  EXPECT_EQ(status->next->file, "gyro-20261121T120000Z.csv");
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
  EXPECT_THAT(events, ElementsAre(HasSubstr("deleted gyro-20261121T120000Z.csv (7 rows, 0.0 MiB)")));
  EXPECT_THAT(index(), HasSubstr("{\"deleted\":1,\"rows\":7,\"before_s\":1795262401}"));
}

TEST_F(SegmentsTest, TheTimeOfADeletionByBytesIsExpectedFromTheGrowth) {
  settings.keep_bytes = 2000;
  Segments segments(settings, "gyro", ".csv", policy());
  made(segments, kNoon, std::string(500, 'x'));
  const std::string open = settings.directory + "/" + made(segments, kNoon + 1);
  segments.retain();
  uptime_s += 100;
  test::write_file(open, std::string(500, 'x'));  // 5 bytes/s
  segments.retain();
  const auto status = segments.retention();
  ASSERT_TRUE(status->next->in_s);
  EXPECT_EQ(status->next->why, NextDeletion::Why::kBytes);
  EXPECT_EQ(status->next->in_s, 201);
}

// A power cut between the deletion of the file and its record.
TEST_F(SegmentsTest, AnInterruptedDeletionIsCompleted) {
  {
    Segments segments(settings, "gyro", ".csv", policy());
    made(segments, kNoon);
    segments.ended(7);
    made(segments, kNoon + 1);
  }
  std::filesystem::remove(settings.directory + "/gyro-20261121T120000Z.csv");
  std::ofstream(settings.directory + "/gyro.csv.index", std::ios::app)
      << "{\"deleting\":1,\"rows\":7,\"before_s\":1795262401}\n";
  for (int restart = 0; restart < 2; ++restart) {
    Segments segments(settings, "gyro", ".csv", policy());
    segments.numbered();
    EXPECT_EQ(segments.deleted_rows(), 7u);
  }
  EXPECT_THAT(events,
              ElementsAre("retention: log: deleted gyro-20261121T120000Z.csv (a power cut interrupted the deletion)"));
}

// Two prismd with one directory: neither deletes a segment that the other writes.
TEST_F(SegmentsTest, ASegmentThatAnotherProcessWritesStays) {
  settings.keep_bytes = 1;
  settings.delete_when_full = true;
  std::filesystem::create_directory(settings.directory);
  const std::string path = settings.directory + "/gyro-20261121T120000Z.csv";
  test::write_file(path, "text");
  const int other = ::open(path.c_str(), O_RDONLY);
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
  for (int day = 0; day < 5; ++day) made(segments, kNoon + day * kDay, "text");
  run(segments, 2 * kDay);
  EXPECT_FALSE(segments.make_room());
  EXPECT_EQ(test::files_in(settings.directory).size(), 5u);
}

TEST_F(SegmentsTest, ADamagedIndexIsOneEvent) {
  settings.keep_days = 1;
  for (const char* damage : {"", "no json\n", "{}\n{\"made\":1}\n"}) {
    Segments segments(settings, "gyro", ".csv", policy());
    made(segments, kNoon);
    test::write_file(settings.directory + "/gyro.csv.index", damage);
    uptime_s += kDay;
    events.clear();
    Segments again(settings, "gyro", ".csv", policy());
    run(again, 200);
    EXPECT_THAT(events,
                ElementsAre("log_damaged: log: gyro.csv.index: was damaged; there is a new one: positions of clients "
                            "and ages of segments begin again"))
        << damage;
  }
}

// A damaged number in the index must not make segments old.
TEST_F(SegmentsTest, ADamagedClockMakesNoSegmentOld) {
  settings.keep_days = 100;
  {
    Segments segments(settings, "gyro", ".csv", policy());
    for (int i = 0; i < 3; ++i) made(segments, kNoon + i);
  }
  for (const char* damage : {"{\"clock_s\":9000000000000000000}\n", "{\"clock_s\":-5}\n", "{\"clock_s\":\"x\"}\n",
                             "{\"ended\":1,\"rows\":3,\"clock_s\":4000000000}\n"}) {
    std::ofstream(settings.directory + "/gyro.csv.index", std::ios::app) << damage;
    Segments segments(settings, "gyro", ".csv", policy());
    run(segments, 3600);
    EXPECT_EQ(test::files_in(settings.directory).size(), 3u) << damage;
  }
}

TEST_F(SegmentsTest, TheTenthOfASecondIsYoungerThanTheSecond) {
  settings.delete_when_full = true;
  Segments segments(settings, "gyro", ".csv");
  for (int i = 0; i < 11; ++i) made(segments);
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(segments.make_room());
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-20261121T120000Z-10.csv", "gyro-20261121T120000Z-11.csv"));
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
  EXPECT_THAT(test::files_in(settings.directory), ElementsAre("gyro-20261121T120002Z.csv"));
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
  test::readable_entries = 0;
  {
    const test::FailingCall fault(test::failing_readdir, EIO);
    EXPECT_FALSE(segments.make_room());
  }
  EXPECT_THAT(test::files_in(settings.directory), testing::Contains("gyro-20261121T120005Z.csv"));
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
