// SPDX-License-Identifier: MIT
// The two ways to the log, on the disk thread and direct, and its clients' cursors over random writing and reading.
#include "daemon/log/row_log.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kNoonS = 1'795'262'400;  // 2026-11-21T12:00:00Z
const std::string kMetadata = "# a: b\n";

struct RowWriterTest : testing::Test {
  void append(LogWriter& writer, int first, int last) {
    for (int i = first; i <= last; ++i) writer.append(test::row_at(kNoonS + i), 1);
  }

  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
  test::Told told, unanswered;
  std::atomic<int> written{0};
  DiskThread disk{3 * sizeof(compensation::CompensatedWindow), unanswered.teller()};
};

TEST_F(RowWriterTest, TheThreadedOneWritesSyncsAndClosesInOrder) {
  {
    LogWriter writer(settings, "gyro", kMetadata, &disk, told.problems, {[this] { ++written; }, [] {}});
    append(writer, 0, 0);
    writer.set_metadata("# a: c\n");
    append(writer, 1, 1);
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
  append(writer, 0, 4);
  EXPECT_EQ(writer.counters().dropped, 2u);
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("the disk cannot keep up; rows are dropped and counted")));
  EXPECT_EQ(written, 0);
  gate.set_value();
  disk.drain();
  EXPECT_EQ(written, 1);  // once, when the third was
  for (int i = 5; i < 8; ++i) {
    disk.drain();
    append(writer, i, i);
    writer.sync();
  }
  disk.drain();
  EXPECT_EQ(writer.counters().rows, 6u);
  EXPECT_EQ(told.lines().back(), "log: writing again after 2 rows were dropped");
}

// Without rows it looks for what retention deletes, at every eleventh call.
TEST_F(RowWriterTest, SyncsWhatIsUnsyncedAndSometimesWithoutRows) {
  std::atomic<int> syncs{0};
  std::vector<int> at;
  LogWriter writer(settings, "gyro", kMetadata, &disk, told.problems, {[] {}, [&] { ++syncs; }});
  const auto sync = [&](int calls) {
    for (int i = 1; i <= calls; ++i) {
      const int before = syncs;
      writer.sync();
      disk.drain();
      if (syncs > before) at.push_back(i);
    }
    return std::exchange(at, {});
  };
  EXPECT_EQ(sync(30), (std::vector{1, 12, 23}));
  append(writer, 0, 0);
  EXPECT_EQ(sync(13), (std::vector{1, 12}));
  append(writer, 1, 1);
  {
    const test::FailingCall fault(test::failing_fdatasync, EIO);
    EXPECT_EQ(sync(3), (std::vector{1, 2, 3})) << "until they are on the disk";
  }
  EXPECT_EQ(sync(2), (std::vector{1}));
  EXPECT_EQ(writer.counters().unsynced, 0u);
}

TEST_F(RowWriterTest, CountsTheRowsThatWaitForTheDisk) {
  LogWriter writer(settings, "gyro", kMetadata, &disk, told.problems, {[this] { ++written; }, [] {}});
  std::promise<void> gate;
  disk.post(0, [&] { gate.get_future().wait(); });
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(writer.counters().pending, static_cast<unsigned>(i));
    append(writer, i, i);
  }
  append(writer, 3, 3);  // is dropped
  EXPECT_EQ(writer.counters().pending, 3u);
  gate.set_value();
  disk.drain();
  EXPECT_EQ(writer.counters().pending, 0u);
  EXPECT_EQ(writer.counters().rows, 3u);
}

TEST_F(RowWriterTest, WithoutADiskThreadItWritesAtOnce) {
  LogWriter writer(settings, "gyro", kMetadata, nullptr, told.problems, {});
  append(writer, 0, 0);
  writer.sync();
  EXPECT_EQ(writer.counters().rows, 1u);
  {
    const test::FailingCall fault(test::failing_write, EIO);
    append(writer, 1, 1);
  }
  EXPECT_THAT(told.lines(), ElementsAre(HasSubstr("Input/output error")));
  EXPECT_EQ(writer.counters().dropped, 1u);
}

TEST(RowCursor, IsReadBackAndNothingElseIs) {
  const RowCursor cursor{std::string(32, 'a'), 7, 12, 4711};
  EXPECT_EQ(RowCursor::parse(cursor.text()), cursor);
  for (const char* wrong : {"", "earliest", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2",
                            "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2-3-4", "gaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2-3",
                            "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-x-3"})
    EXPECT_FALSE(RowCursor::parse(wrong)) << wrong;
}

struct LogRowsTest : testing::Test {
  std::unique_ptr<RowLog> open() {
    return std::make_unique<RowLog>(
        settings, "gyro", "# prism TEST data log, format 2\n# instance: gyro\n", counters, told.problems,
        SegmentPolicy{[this](auto, const std::string& kind, auto&) { events.push_back(kind); }, true, 0});
  }
  const test::TemporaryFolder folder;
  config::LogSegmentSettings settings = test::segments_in(folder.file("log"));
  LogCounters counters;
  test::Told told;
  std::vector<std::string> events;
};

// Random sequences of rows, syncs, sessions, clean and unclean ends, retention and requests.
TEST_F(LogRowsTest, EveryRowComesOnceOrIsCountedAsMissing) {
  settings.max_bytes = 4000;
  settings.keep_bytes = 20'000;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::filesystem::remove_all(settings.directory);
    std::mt19937 random(seed);
    auto log = open();
    std::vector<std::int64_t> got;
    std::string cursor = "earliest";
    std::uint64_t missing = 0;
    const auto take = [&](std::size_t limit) {
      const auto page = log->page({cursor, limit});
      ASSERT_TRUE(page || page.error().gone > 0) << page.error().text;
      cursor = page ? page->after.text() : page.error().after.text();
      missing += page ? page->missing : page.error().gone;
      if (!page) {
        const std::uint64_t last = page.error().after.total;
        EXPECT_THAT(page.error().text, HasSubstr(fmt::format("rows {} to {} of the log were deleted",
                                                             last - page.error().gone + 1, last)));
        return;
      }
      const json answer = json::parse(page->json + "}");
      EXPECT_EQ(answer["after"], cursor);
      for (const json& segment : answer["segments"]) {
        EXPECT_EQ(segment["metadata"]["instance"], "gyro");
        for (const std::string row : segment["rows"]) got.push_back(std::stoll(row.substr(row.find(',') + 1)));
      }
    };
    std::int64_t second = 1'700'000'000, session = 0, first = second;
    for (int step = 0; step < 600; ++step) {
      const auto what = random() % 100;
      if (what < 70) {
        log->append(test::row_at(second++), session);
      } else if (what < 85) {
        log->sync();
      } else if (what < 88) {
        ++session;
      } else if (what < 91) {
        log->sync();
        if (random() % 2 == 0) log->close();
        log = open();
        ++session;
      } else {
        take(1 + random() % 40);
      }
    }
    log->sync();
    for (std::string before; before != cursor;) {
      before = cursor;
      take(1000);
    }
    EXPECT_EQ(got.size() + missing, static_cast<std::size_t>(second - first)) << "seed " << seed;
    EXPECT_GT(got.size(), 50u);
    EXPECT_THAT(events, testing::Contains("retention")) << "seed " << seed;
    events.clear();
    for (std::size_t i = 1; i < got.size(); ++i) ASSERT_LT(got[i - 1], got[i]) << "seed " << seed;
  }
}

// "log" is in the page, and "sensor_line" may occur several times.
TEST_F(LogRowsTest, APageSaysWhatItHasAndWhatFollows) {
  auto log = std::make_unique<RowLog>(settings, "gyro", "# a: b\n# sensor_line: x\n# sensor_line: y\n", counters,
                                      told.problems, SegmentPolicy{});
  for (int i = 0; i < 5; ++i) log->append(test::row_at(kNoonS + i), 0);
  log->sync();
  const auto page = log->page({"earliest", 2, true});
  ASSERT_TRUE(page);
  EXPECT_EQ(page->rows, 2u);
  json all = json::parse(page->json + "}");
  const json segment = all["segments"][0];
  EXPECT_EQ(segment["segment"], 1);
  EXPECT_EQ(segment["first"], 1);
  EXPECT_EQ(segment["metadata"], json::parse(R"({"a": "b", "session": "1970-01-01T00:00:00.000000000Z"})"));
  EXPECT_THAT(segment["header"].get<std::string>(), testing::StartsWith("# a: b\n# sensor_line: x\n"));
  all.erase("segments"), all.erase("log"), all.erase("after");
  EXPECT_EQ(all, json::parse(R"({"more": true, "missing": 0, "behind": 3, "kept": 5, "deleted": 0})"));
  const json rest = json::parse(log->page({page->after.text(), 10})->json + "}");
  EXPECT_EQ(rest["segments"][0]["first"], 3);
  EXPECT_FALSE(rest["segments"][0].contains("header"));
  EXPECT_EQ(rest["more"], false);
  EXPECT_EQ(rest["behind"], 0);
}

// A segment edited by hand: its lines are returned unchanged, in valid JSON.
TEST_F(LogRowsTest, WhatWasWrittenByHandIsTextLikeAnyOther) {
  auto log = open();
  for (int i = 0; i < 2; ++i) log->append(test::row_at(i), 0);
  log->sync();
  log.reset();
  const std::string path = settings.directory + "/" + test::files_in(settings.directory).front();
  const std::string text = test::content(path);
  test::write_file(path, text.substr(0, text.find("time_utc")) + "time\"utc,\\\na\"b\\c\t\xff,1\n2,3\n");
  const auto page = open()->page({"earliest", 10});
  ASSERT_TRUE(page);
  const json segment = json::parse(page->json + "}")["segments"][0];
  EXPECT_EQ(segment["columns"], "time\"utc,\\");
  EXPECT_EQ(segment["rows"], json::parse(R"(["a\"b\\c\t\uFFFD,1", "2,3"])"));
}

}  // namespace
}  // namespace prism::log
