// SPDX-License-Identifier: MIT
// Reads a log by cursor while it is written, killed and shortened: every row once, in order, and all gaps counted.
#include "daemon/log/log_pager.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "daemon/log/row_log.hpp"
#include "tests/support/temporary_folder.hpp"

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
  std::unique_ptr<RowLog> open() {
    return std::make_unique<RowLog>(settings, "gyro", "# prism TEST data log, format 2\n# instance: gyro\n", counters,
                                    [](const std::string&) {});
  }
  /// Returns the seconds of a page's rows and advances the cursor.
  std::vector<std::int64_t> take(RowLog& log, std::string& cursor, std::size_t limit, std::uint64_t& missing) {
    const auto page = log.page({cursor, limit});
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
    for (std::size_t before = got.size() + 1; before != got.size();) {
      before = got.size();
      const auto seconds = take(*log, cursor, 1000, missing);
      got.insert(got.end(), seconds.begin(), seconds.end());
    }
    EXPECT_EQ(got.size() + missing, static_cast<std::size_t>(second - first)) << "seed " << seed;
    EXPECT_GT(got.size(), 50u);
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
    if (entry.path().extension() != ".csv") continue;
    std::ofstream(entry.path())
        << "# prism TEST data log, format 2\n# instance: gyro\ntime\"utc,\\\na\"b\\c\t\xff,1\n2,3\n";
  }
  log = open();
  const auto page = log->page({"earliest", 10});
  ASSERT_TRUE(page);
  const json answer = json::parse(page->json + "}");
  EXPECT_EQ(answer["segments"][0]["columns"], "time\"utc,\\");
  EXPECT_EQ(answer["segments"][0]["rows"][0], "a\"b\\c\t\xef\xbf\xbd,1");
  EXPECT_EQ(answer["segments"][0]["rows"][1], "2,3");
}

TEST_F(LogRowsTest, AFolderThatWasEmptiedIsAnotherLog) {
  auto log = open();
  log->append(row_of(1), 0);
  log->sync();
  std::string cursor = "earliest";
  std::uint64_t missing = 0;
  take(*log, cursor, 10, missing);
  log->close();
  std::filesystem::remove_all(settings.directory);
  log = open();
  log->append(row_of(1), 0);
  log->sync();
  const auto page = log->page({cursor, 10});
  ASSERT_FALSE(page);
  EXPECT_THAT(page.error().text,
              HasSubstr("the directory was emptied or replaced; use \"earliest\" to read it from the start"));
}

}  // namespace
}  // namespace prism::log
