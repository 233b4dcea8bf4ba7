// SPDX-License-Identifier: MIT
// Segments: names, rotation, retention, and errors of each file system call.
#include "daemon/log/segments.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/fsuid.h>
#include <unistd.h>

#include <cerrno>

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

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
};

TEST_F(SegmentsTest, AreNamedAfterTheirFirstSecondAndNumberedWithinIt) {
  Segments segments(settings, "gyro", ".csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z.csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z-2.csv");
  EXPECT_EQ(made(segments), "gyro-20261121T120000Z-3.csv");
  EXPECT_EQ(made(segments, kNoon + 1), "gyro-20261121T120001Z.csv");
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
  Segments segments(settings, "gyro", ".csv");
  for (int i = 0; i < 4; ++i) made(segments, kNoon + i, std::string(100, 'x'));
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-20261121T120001Z.csv", "gyro-20261121T120002Z.csv", "gyro-20261121T120003Z.csv"));
}

TEST_F(SegmentsTest, TheOldestGoBeyondTheDaysThatAreKept) {
  settings.keep_days = 2;
  Segments segments(settings, "gyro", ".csv");
  for (int day = 0; day < 4; ++day) made(segments, kNoon + day * kDay);
  EXPECT_THAT(test::files_in(settings.directory),
              ElementsAre("gyro-20261122T120000Z.csv", "gyro-20261123T120000Z.csv", "gyro-20261124T120000Z.csv"));
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
  Segments segments(settings, "gyro", ".csv");
  const std::string mine = made(segments);
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
  Segments segments(settings, "gyro", ".csv");
  for (int i = 0; i < 3; ++i) made(segments, kNoon);
  for (int entries = 0; entries < 6; ++entries) {
    const test::FailingCall fault(test::failing_readdir, EIO);
    test::readable_entries = entries;
    made(segments, kNoon + entries);
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
