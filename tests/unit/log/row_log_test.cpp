// SPDX-License-Identifier: MIT
// The log has complete rows only, at any disk error; start and end of an error are reported once.
#include "daemon/log/row_log.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <future>
#include <memory>
#include <sstream>

#include "base/sha256.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr std::int64_t kNoonS = 1'795'262'400;  // 2026-11-21T12:00:00Z
const std::string kMetadata = "# a: b\n";

struct RowLogTest : testing::Test {
  void SetUp() override { begin(); }
  void begin() {
    log = std::make_unique<RowLog>(settings, "gyro", kMetadata, counters, told.problems,
                                   SegmentPolicy{told.events(), true, 60, [] { return 0; }});
  }
  void append(int count) {
    for (int i = 0; i < count; ++i) log->append(test::row_at(next++), session_ns);
  }
  // A row of which ten bytes are written, and stay.
  void append_torn() {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    const test::FailingCall fixed(test::failing_ftruncate, EIO);
    test::writable_bytes = 10;
    append(1);
  }
  std::string path(const std::string& name) const { return settings.directory + "/" + name; }
  // Lines of a segment below the metadata and the names of the columns.
  std::vector<std::string> rows(const std::string& name) const {
    std::istringstream in(test::content(path(name)));
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) {
      if (line[0] >= '0' && line[0] <= '9') lines.push_back(line);
    }
    return lines;
  }

  // The end line of the complete segment `text` with `rows` rows.
  static std::string end_of(const std::string& text, int rows) {
    return fmt::format("# end: rows {}, sha256 {}\n", rows, sha256_hex(text.substr(0, text.find("# end: "))));
  }

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
  LogCounters counters;
  test::Told told;
  std::int64_t next = kNoonS, session_ns = 1'000'000'001;
  std::unique_ptr<RowLog> log;
};

TEST_F(RowLogTest, MetadataAndColumnsStandAboveTheRowsOfEverySegment) {
  settings.max_bytes = 800;
  begin();
  append(20);
  log.reset();
  const auto files = test::files_in(settings.directory);
  ASSERT_GT(files.size(), 1u);
  EXPECT_EQ(files.front(), "gyro-000001-20261121T120000Z.csv");
  const std::string others = kMetadata + "# session: 1970-01-01T00:00:01.000000001Z\n";
  std::size_t sum = 0;
  int number = 0;
  for (const std::string& file : files) {
    EXPECT_THAT(test::content(path(file)),
                StartsWith(fmt::format("{}# log: {:.32} segment {} first {} running 0\ntime_utc", others,
                                       sha256_hex(others), ++number, sum + 1)));
    sum += rows(file).size();
  }
  EXPECT_EQ(sum, 20u);
  EXPECT_EQ(counters.rows, 20u);
  EXPECT_EQ(counters.segments, files.size());
  EXPECT_THAT(told.lines(), IsEmpty());
}

TEST_F(RowLogTest, OtherMetadataBeginASegmentAndTheSameDoNot) {
  append(2);
  log->set_metadata(kMetadata);
  append(1);
  log->set_metadata("# a: c\n");
  append(1);
  log.reset();
  EXPECT_EQ(rows("gyro-000001-20261121T120000Z.csv").size(), 3u);
  EXPECT_THAT(test::content(path("gyro-000002-20261121T120003Z.csv")), StartsWith("# a: c\n"));
}

// The segment distinguishes a second at the end of a session from the same second in the next one.
TEST_F(RowLogTest, EachSessionBeginsASegmentAndEachSegmentEndsWithItsSum) {
  append(2);
  session_ns = 2'000'000'000;
  next -= 1;
  append(2);
  log.reset();
  const std::string first = test::content(path("gyro-000001-20261121T120000Z.csv"));
  const std::string second = test::content(path("gyro-000002-20261121T120001Z.csv"));
  EXPECT_THAT(first, AllOf(HasSubstr("# session: 1970-01-01T00:00:01.000000001Z\n"), EndsWith(end_of(first, 2))));
  EXPECT_THAT(second, AllOf(HasSubstr("# session: 1970-01-01T00:00:02.000000000Z\n"), EndsWith(end_of(second, 2))));
  EXPECT_EQ(counters.segments, 2u);
}

TEST_F(RowLogTest, ASegmentIsLockedAsLongAsItIsWritten) {
  append(1);
  const int other = ::open(path("gyro-000001-20261121T120000Z.csv").c_str(), O_RDONLY | O_CLOEXEC);
  EXPECT_EQ(::flock(other, LOCK_SH | LOCK_NB), -1);
  log.reset();
  EXPECT_EQ(::flock(other, LOCK_SH | LOCK_NB), 0);
  ::close(other);
}

TEST_F(RowLogTest, ASegmentWhoseTornRowStaysHasNoEnd) {
  append(2);
  append_torn();
  log.reset();
  EXPECT_THAT(test::content(path("gyro-000001-20261121T120000Z.csv")), Not(HasSubstr("# end")));
}

TEST_F(RowLogTest, AFaultIsToldOnceAndItsEndOnceWhenRowsStandOnTheDiskAgain) {
  append(1);
  {
    const test::FailingCall fault(test::failing_write, EIO);
    for (int i = 0; i < 5; ++i) {
      append(1);
      log->sync();
    }
  }
  EXPECT_THAT(told.lines(),
              ElementsAre(AllOf(StartsWith("log: "), HasSubstr("cannot be written: Input/output error"))));
  for (int i = 0; i < 5; ++i) {
    append(1);
    log->sync();
  }
  ASSERT_EQ(told.lines().size(), 2u);
  EXPECT_EQ(told.lines()[1], "log: writing again after 5 rows were dropped");
  EXPECT_EQ(counters.rows, 6u);
  EXPECT_EQ(counters.dropped, 5u);
}

// A disk that takes every other row is one fault: it is not over while rows go missing between two syncs.
TEST_F(RowLogTest, ADiskThatFailsEveryOtherTimeIsOneFault) {
  for (int i = 0; i < 6; ++i) {
    {
      const test::FailingCall fault(test::failing_write, EIO);
      append(1);
    }
    append(1);
    log->sync();
  }
  EXPECT_EQ(told.lines().size(), 1u);
  log->sync();
  EXPECT_THAT(told.lines().back(), EndsWith("writing again after 6 rows were dropped"));
}

TEST_F(RowLogTest, ATornRowIsCutOff) {
  append(2);
  {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    test::writable_bytes = 10;
    append(1);
  }
  append(1);
  log.reset();
  const std::string text = test::content(path("gyro-000001-20261121T120000Z.csv"));
  EXPECT_EQ(rows("gyro-000001-20261121T120000Z.csv").size(), 3u);
  EXPECT_THAT(text, Not(HasSubstr("T12:00:02")));
  EXPECT_THAT(text, EndsWith(end_of(text, 3))) << "the checksum does not include the removed row";
}

TEST_F(RowLogTest, ATornRowThatCannotBeCutOffEndsItsSegment) {
  append(2);
  append_torn();
  append(1);
  log.reset();
  EXPECT_EQ(rows("gyro-000002-20261121T120003Z.csv").size(), 1u);
}

TEST_F(RowLogTest, AFullDiskLeavesNoSegmentWithoutItsMetadata) {
  {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    test::writable_bytes = 3;
    append(3);
  }
  EXPECT_THAT(test::files_in(settings.directory), IsEmpty());
  append(1);
  EXPECT_EQ(test::files_in(settings.directory).size(), 1u);
  EXPECT_EQ(counters.dropped, 3u);
  EXPECT_EQ(counters.segments, 1u);
}

TEST_F(RowLogTest, AFullDiskCostsTheOldestSegmentWhereTheConfigurationSaysSo) {
  settings.delete_when_full = true;
  settings.max_age_s = 10;
  begin();
  append(21);
  const auto before = test::files_in(settings.directory);
  {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    append(1);
  }
  EXPECT_EQ(before.size(), 3u);
  EXPECT_EQ(test::files_in(settings.directory).size(), 1u) << "all but the one that is written";
  EXPECT_EQ(told.lines().size(), 1u);
}

// Earlier bug: after EIO of fdatasync the log continued with the same descriptor and reported recovery at the next
// successful sync, although the kernel had discarded data.
TEST_F(RowLogTest, AfterAFailedSyncItsRowsStandAgainInASegmentThatSupersedesThem) {
  append(3);
  log->sync();
  append(2);
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO, 1);
    log->sync();
  }
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("cannot be synced: Input/output error")));
  EXPECT_EQ(counters.rows, 3u);
  append(1);
  EXPECT_EQ(counters.unsynced, 3u);
  log->sync();
  append(1);
  log->sync();
  log->sync();
  EXPECT_THAT(told.lines().back(), EndsWith("writing again after 0 rows were dropped"));
  EXPECT_EQ(told.lines().size(), 2u);
  EXPECT_EQ(counters.rows, 7u);
  EXPECT_EQ(counters.unsynced, 0u);
  log.reset();
  EXPECT_EQ(rows("gyro-000001-20261121T120000Z.csv").size(), 5u);
  EXPECT_THAT(test::content(path("gyro-000001-20261121T120000Z.csv")), Not(HasSubstr("# end")));
  EXPECT_EQ(rows("gyro-000002-20261121T120003Z.csv").size(), 4u);
  EXPECT_THAT(test::content(path("gyro-000002-20261121T120003Z.csv")),
              HasSubstr("# supersedes: gyro-000001-20261121T120000Z.csv from row 4\n"));
}

TEST_F(RowLogTest, AFullDiskAfterAFailedSyncDoesNotHideWhichRowsAreUncertain) {
  append(3);
  log->sync();
  append(1);
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO, 1);
    log->sync();
  }
  {
    const test::FailingCall fault(test::failing_write, ENOSPC);
    log->sync();
  }
  append(1);
  log->sync();
  log.reset();
  EXPECT_THAT(test::content(path("gyro-000002-20261121T120004Z.csv")),
              HasSubstr("# supersedes: gyro-000001-20261121T120000Z.csv from row 4\n"));
}

TEST_F(RowLogTest, ADiskThatNeverSyncsGetsNoFileASecondAndLosesNoRow) {
  append(1);
  log->sync();
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO);
    for (int i = 0; i < 40; ++i) {
      append(1);
      log->sync();
    }
    EXPECT_LE(test::files_in(settings.directory).size(), 2u);
  }
  EXPECT_EQ(told.lines().size(), 1u);
  for (int i = 0; i < 70; ++i) log->sync();
  EXPECT_EQ(told.lines().size(), 2u);
  EXPECT_EQ(counters.rows, 41u);
  EXPECT_EQ(counters.dropped, 0u);
  log.reset();
  EXPECT_EQ(rows("gyro-000001-20261121T120000Z.csv").size(), 2u);
  EXPECT_EQ(rows("gyro-000002-20261121T120001Z.csv").size(), 40u);
}

TEST_F(RowLogTest, AFolderThatIsAFileIsAFaultUntilItIsGone) {
  test::write_file(settings.directory, "in the way");
  append(3);
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("cannot be created: Not a directory")));
  std::filesystem::remove(settings.directory);
  append(1);
  EXPECT_EQ(counters.rows, 1u);
  EXPECT_EQ(counters.dropped, 3u);
}

TEST_F(RowLogTest, ANameTooLongIsAFaultAndNoEnd) {
  RowLog longest(settings, std::string(250, 'n'), kMetadata, counters, told.problems);
  longest.append(test::row_at(kNoonS), session_ns);
  longest.append(test::row_at(kNoonS + 1), session_ns);
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("File name too long")));
  EXPECT_EQ(counters.dropped, 2u);
}

// Earlier bug: the directory was deleted while prismd ran, and 9 rows were "written" to the deleted file.
TEST_F(RowLogTest, ADeletedFolderIsNoticedAtTheNextSyncAndMadeAnew) {
  append(2);
  log->sync();
  std::filesystem::remove_all(settings.directory);
  append(1);
  log->sync();
  EXPECT_THAT(told.lines(), ElementsAre(AllOf(HasSubstr("gyro-000001-20261121T120000Z.csv: was deleted"),
                                              HasSubstr("starting a new segment"))));
  append(1);
  log->sync();
  EXPECT_THAT(test::files_in(settings.directory), ElementsAre("gyro-000002-20261121T120003Z.csv"));
  EXPECT_EQ(told.lines().size(), 1u);
}

TEST_F(RowLogTest, ARowThatNeverCameHereIsCountedAndTold) {
  log->lose("no memory");
  log->lose("no memory");
  EXPECT_EQ(counters.dropped, 2u);
  EXPECT_THAT(told.lines(), ElementsAre("log: no memory; rows are dropped and counted until it works again"));
}

// The two ways to it.
struct RowWriterTest : RowLogTest {
  test::Told unanswered;
  std::atomic<int> written{0};
  DiskThread disk{3 * sizeof(compensation::CompensatedWindow), unanswered.teller()};
};

TEST_F(RowWriterTest, TheThreadedOneWritesSyncsAndClosesInOrder) {
  {
    LogWriter writer(settings, "gyro", kMetadata, &disk, told.problems, {[this] { ++written; }, [] {}});
    writer.append(test::row_at(kNoonS), session_ns);
    writer.set_metadata("# a: c\n");
    writer.append(test::row_at(kNoonS + 1), session_ns);
    writer.sync();
    disk.drain();
    EXPECT_EQ(writer.counters().rows, 2u);
    writer.close();
    std::string answer;
    writer.read({}, [&answer](const pipeline::RowResult& page) { answer = page ? "a page" : page.error().text; });
    EXPECT_EQ(answer, "rows: the log is closed");
  }
  disk.drain();
  EXPECT_EQ(test::files_in(settings.directory).size(), 2u);
}

TEST_F(RowWriterTest, RowsThatTheQueueCannotTakeAreCountedAndToldAtOnce) {
  LogWriter writer(settings, "gyro", kMetadata, &disk, told.problems, {[this] { ++written; }, [] {}});
  std::promise<void> gate;
  disk.post(0, [&] { gate.get_future().wait(); });
  for (int i = 0; i < 5; ++i) writer.append(test::row_at(kNoonS + i), session_ns);
  EXPECT_EQ(writer.counters().dropped, 2u);
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("the disk cannot keep up; rows are dropped and counted")));
  EXPECT_EQ(written, 0);
  gate.set_value();
  disk.drain();
  EXPECT_EQ(written, 1);  // once, when the third was
  for (int i = 0; i < 3; ++i) {
    disk.drain();
    writer.append(test::row_at(kNoonS + 5 + i), session_ns);
    writer.sync();
  }
  disk.drain();
  EXPECT_EQ(writer.counters().rows, 6u);
  EXPECT_EQ(told.lines().back(), "log: writing again after 2 rows were dropped");
}

TEST_F(RowWriterTest, WithoutADiskThreadItWritesAtOnce) {
  LogWriter writer(settings, "gyro", kMetadata, nullptr, told.problems, {});
  writer.append(test::row_at(kNoonS), session_ns);
  writer.sync();
  EXPECT_EQ(writer.counters().rows, 1u);
  {
    const test::FailingCall fault(test::failing_write, EIO);
    writer.append(test::row_at(kNoonS + 1), session_ns);
  }
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("Input/output error")));
  EXPECT_EQ(writer.counters().dropped, 1u);
}

}  // namespace
}  // namespace prism::log
