// SPDX-License-Identifier: MIT
// Reads a log by cursor while it is written, killed and shortened: every row once, in order, and all gaps counted.
#include "daemon/log/log_pager.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "daemon/log/row_log.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

using nlohmann::json;
using testing::HasSubstr;

compensation::CompensatedWindow row_of(std::int64_t second) {
  compensation::CompensatedWindow row;
  row.window.second_mean.second = second;
  row.window.second_mean.samples = 100;
  return row;
}

struct LogRowsTest : testing::Test {
  LogRowsTest() { settings.directory = folder.file("log"); }
  Problems problems{[](auto, auto&, auto&) {}};
  std::unique_ptr<RowLog> open() {
    return std::make_unique<RowLog>(
        settings, "gyro", "# prism TEST data log, format 2\n# instance: gyro\n", counters, problems,
        SegmentPolicy{[this](pipeline::Severity, const std::string& kind, const std::string& text) {
                        events.push_back(kind + ": " + text);
                      },
                      true, 0});
  }
  /// Writes a log of one row; returns the cursor after it.
  std::string after_one_row() {
    const auto log = open();
    log->append(row_of(1), 0);
    log->sync();
    std::string cursor = "earliest";
    std::uint64_t missing = 0;
    take(*log, cursor, 10, missing);
    log->close();
    return cursor;
  }
  /// Returns the seconds of a page's rows and advances the cursor.
  std::vector<std::int64_t> take(RowLog& log, std::string& cursor, std::size_t limit, std::uint64_t& missing) {
    const auto page = log.page({cursor, limit});
    if (!page && page.error().gone > 0) {
      const RowRefusal& late = page.error();
      EXPECT_THAT(late.text, HasSubstr(fmt::format("rows {} to {} of the log were deleted",
                                                   late.after.total - late.gone + 1, late.after.total)));
      cursor = late.after.text();
      missing += late.gone;
      return {};
    }
    if (!page) throw std::runtime_error(page.error().text);
    const json answer = json::parse(page->json + "}");
    std::vector<std::int64_t> seconds;
    for (const json& segment : answer["segments"]) {
      EXPECT_EQ(segment["metadata"]["instance"], "gyro");
      for (const std::string line : segment["rows"]) seconds.push_back(std::stoll(line.substr(line.find(',') + 1)) - 1);
    }
    EXPECT_EQ(answer["after"], page->after.text());
    cursor = page->after.text();
    missing += page->missing;
    return seconds;
  }
  test::TemporaryFolder folder;
  config::LogSegmentSettings settings;
  LogCounters counters;
  std::vector<std::string> events;
};

/// Three sessions of ten rows, each a segment; the second one is damaged.
struct DamagedSegmentTest : LogRowsTest {
  DamagedSegmentTest() {
    auto log = open();
    for (int i = 0; i < 30; ++i) log->append(row_of(i), i / 10);
    log->close();
    for (const auto& entry : std::filesystem::directory_iterator(settings.directory))
      if (entry.path().filename() == "gyro-000002-19700101T000011Z.csv") path = entry.path();
  }
  std::string text() const {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Position of the row of `second` in the file.
  std::size_t row_at(int second) const { return text().find("1970-01-01T00:00:" + std::to_string(second + 1)); }
  /// Reads all pages; checks that the cursor moves until the end.
  std::vector<std::int64_t> all(RowLog& log, std::uint64_t& missing, std::size_t limit) {
    std::vector<std::int64_t> seconds;
    std::string cursor = "earliest", before;
    while (cursor != before) {
      before = cursor;
      const auto page = take(log, cursor, limit, missing);
      seconds.insert(seconds.end(), page.begin(), page.end());
    }
    return seconds;
  }
  /// Reads everything by pages of several sizes: `rows` in total, the others are missing, with one event.
  void expect(std::size_t rows, const std::string& event) {
    for (const std::size_t limit : {1UL, 3UL, 10UL, 1000UL}) {
      events.clear();
      const auto log = open();
      for (int twice = 0; twice < 2; ++twice) {
        std::uint64_t missing = 0;
        const auto seconds = all(*log, missing, limit);
        EXPECT_EQ(seconds.size(), rows) << "limit " << limit;
        EXPECT_EQ(missing, 30 - rows) << "limit " << limit;
        EXPECT_EQ(seconds.back(), 29) << "the rows after the damage arrive";
        EXPECT_FALSE(log->page({"latest", 10})->missing);
      }
      EXPECT_THAT(events, testing::ElementsAre(event)) << "limit " << limit;
    }
  }
  std::string path;
};

TEST(RowCursor, IsReadBackAndNothingElseIs) {
  const RowCursor cursor{std::string(32, 'a'), 7, 12, 4711};
  EXPECT_EQ(RowCursor::parse(cursor.text()), cursor);
  for (const char* wrong : {"", "earliest", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa", "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2",
                            "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2-3-4", "gaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-2-3",
                            "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa-1-x-3"})
    EXPECT_FALSE(RowCursor::parse(wrong)) << wrong;
}

TEST_F(LogRowsTest, OnlyWhatIsOnTheDiskIsTold) {
  const auto log = open();
  std::string cursor = "earliest";
  std::uint64_t missing = 0;
  for (int i = 0; i < 3; ++i) log->append(row_of(i), 0);
  EXPECT_TRUE(take(*log, cursor, 10, missing).empty());
  log->sync();
  EXPECT_EQ(take(*log, cursor, 2, missing), (std::vector<std::int64_t>{0, 1}));
  log->append(row_of(3), 0);
  EXPECT_EQ(take(*log, cursor, 10, missing), (std::vector<std::int64_t>{2}));
  EXPECT_EQ(missing, 0u);
}

// Random sequences of rows, syncs, sessions, clean and unclean ends, retention and requests.
TEST_F(LogRowsTest, EveryRowComesOnceOrIsCountedAsMissing) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::filesystem::remove_all(settings.directory);
    settings.max_bytes = 4000;
    settings.keep_bytes = 20'000;
    std::mt19937 random(seed);
    auto log = open();
    std::vector<std::int64_t> got;
    std::string cursor = "earliest";
    std::uint64_t missing = 0;
    std::int64_t second = 1'700'000'000, session = 0, first = second;
    for (int step = 0; step < 600; ++step) {
      const auto what = random() % 100;
      if (what < 70) {
        log->append(row_of(second++), session);
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
        const auto seconds = take(*log, cursor, 1 + random() % 40, missing);
        got.insert(got.end(), seconds.begin(), seconds.end());
      }
    }
    log->sync();
    for (std::string before; before != cursor;) {
      before = cursor;
      const auto seconds = take(*log, cursor, 1000, missing);
      got.insert(got.end(), seconds.begin(), seconds.end());
    }
    EXPECT_EQ(got.size() + missing, static_cast<std::size_t>(second - first)) << "seed " << seed;
    EXPECT_GT(got.size(), 50u);
    EXPECT_THAT(events, testing::Contains(HasSubstr("retention: log: deleted "))) << "seed " << seed;
    events.clear();
    for (std::size_t i = 1; i < got.size(); ++i) ASSERT_LT(got[i - 1], got[i]) << "seed " << seed;
  }
}

// A segment edited by hand: its lines are returned unchanged, in valid JSON.
TEST_F(LogRowsTest, WhatWasWrittenByHandIsTextLikeAnyOther) {
  auto log = open();
  for (int i = 0; i < 2; ++i) log->append(row_of(i), 0);
  log->sync();
  log.reset();
  for (const auto& entry : std::filesystem::directory_iterator(settings.directory)) {
    const std::string text = test::content(entry.path());
    std::ofstream(entry.path()) << text.substr(0, text.find("time_utc")) << "time\"utc,\\\na\"b\\c\t\xff,1\n2,3\n";
  }
  log = open();
  const auto page = log->page({"earliest", 10});
  ASSERT_TRUE(page);
  const json answer = json::parse(page->json + "}");
  EXPECT_EQ(answer["segments"][0]["columns"], "time\"utc,\\");
  EXPECT_EQ(answer["segments"][0]["rows"][0], "a\"b\\c\t\xef\xbf\xbd,1");
  EXPECT_EQ(answer["segments"][0]["rows"][1], "2,3");
}

// Earlier bug: prismd returned an empty page with "more" and the same cursor, for ever.
TEST_F(DamagedSegmentTest, CutShortItsLostRowsAreMissing) {
  std::filesystem::resize_file(path, row_at(15));
  expect(25,
         "log_damaged: log: gyro-000002-19700101T000011Z.csv: found 5 of 10 rows that were written; the others are "
         "missing "
         "for clients");
}

TEST_F(DamagedSegmentTest, CutWithinARowThisRowIsMissingToo) {
  std::filesystem::resize_file(path, row_at(15) + 30);
  expect(25,
         "log_damaged: log: gyro-000002-19700101T000011Z.csv: found 5 of 10 rows that were written; the others are "
         "missing "
         "for clients");
}

TEST_F(DamagedSegmentTest, LostLinesInTheMiddleAreMissingAndTheEndIsNoRow) {
  std::string cut = text();
  cut.erase(row_at(12), row_at(15) - row_at(12));
  std::ofstream(path) << cut;
  expect(27,
         "log_damaged: log: gyro-000002-19700101T000011Z.csv: found 7 of 10 rows that were written; the others are "
         "missing "
         "for clients");
}

TEST_F(DamagedSegmentTest, CutInItsHeaderOrEmptiedAllItsRowsAreMissing) {
  for (const std::size_t bytes : {40, 0}) {
    std::filesystem::resize_file(path, bytes);
    expect(20,
           "log_damaged: log: gyro-000002-19700101T000011Z.csv: found 0 of 10 rows that were written; the others are "
           "missing "
           "for clients");
  }
}

// A loss at the end is known only to clients, whose cursors are refused.
TEST_F(DamagedSegmentTest, TheLastSegmentCutOrRemovedIsNoPlaceToContinue) {
  std::string cursor = "latest";
  std::uint64_t missing = 0;
  take(*open(), cursor, 7, missing);
  const std::string last = settings.directory + "/gyro-000003-19700101T000021Z.csv";
  for (const bool remove : {false, true}) {
    remove ? void(std::filesystem::remove(last)) : std::filesystem::resize_file(last, 10);
    const auto log = open();
    EXPECT_EQ(all(*log, missing, 7).size(), 20u);
    EXPECT_EQ(missing, 0u);
    EXPECT_THAT(log->page({cursor, 7}).error().text, HasSubstr("which the log does not have"));
  }
}

TEST_F(DamagedSegmentTest, AFolderInThePlaceOfAFileIsAGap) {
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  const auto log = open();
  std::uint64_t missing = 0;
  EXPECT_EQ(all(*log, missing, 7).size(), 20u);
  EXPECT_EQ(missing, 10u);
}

TEST_F(LogRowsTest, AFolderThatWasEmptiedIsAnotherLog) {
  const std::string cursor = after_one_row();
  std::filesystem::remove_all(settings.directory);
  const auto log = open();
  log->append(row_of(1), 1);
  log->sync();
  const auto page = log->page({cursor, 10});
  ASSERT_FALSE(page);
  EXPECT_THAT(page.error().text,
              HasSubstr("the directory was emptied or replaced; use \"earliest\" to read it from the start"));
}

// Not another log, from which a client would read all rows again.
TEST_F(LogRowsTest, AFolderThatCannotBeListedIsUnreadable) {
  const std::string cursor = after_one_row();
  const auto log = open();
  test::readable_entries = 0;
  const test::FailingCall fault(test::failing_readdir, EIO);
  const auto page = log->page({cursor, 10});
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().why, RowRefusal::Why::kUnreadable);
  EXPECT_THAT(page.error().text, HasSubstr("cannot be listed: Input/output error"));
}

// Earlier bug: half a line of the header was served as row 1.
TEST_F(LogRowsTest, EmptiedWhileItIsWrittenItGoesOnWithTheNextRow) {
  const auto log = open();
  for (int second = 1; second < 4; ++second) log->append(row_of(second), 0);
  log->sync();
  std::string cursor = "earliest", again = cursor;
  std::uint64_t missing = 0;
  take(*log, cursor, 1, missing);
  for (const auto& entry : std::filesystem::directory_iterator(settings.directory))
    std::filesystem::remove(entry.path());
  log->set_metadata(
      "# prism TEST data log, format 2\n# instance: gyro\n# model: another, so that the header is longer\n");
  for (int second = 4; second < 9; ++second) log->append(row_of(second), 0), log->sync();
  EXPECT_EQ(take(*log, again, 10, missing), (std::vector<std::int64_t>{4, 5, 6, 7, 8}));
  EXPECT_EQ(missing, 3u);
  EXPECT_EQ(take(*log, cursor, 10, missing), (std::vector<std::int64_t>{4, 5, 6, 7, 8}));
  EXPECT_EQ(missing, 3u + 2u);
}

}  // namespace
}  // namespace prism::log
