// SPDX-License-Identifier: MIT
// Named consumers of a log: stored, owned by a user, and respected by retention.
#include "daemon/log/consumer_registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "daemon/log/retention.hpp"
#include "daemon/log/row_log.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::log {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct FollowersTest : testing::Test {
  ConsumerRegistry open(std::vector<std::string> keep_for = {}) {
    return ConsumerRegistry(folder.file("gyro.csv.followers"), std::move(keep_for),
                            [this](auto, auto&, const std::string& what) { told.push_back(what); });
  }
  static RowCursor behind(std::uint64_t segment, std::uint64_t row) {
    return {std::string(32, 'a'), segment, row, 100 * segment + row};
  }
  test::TemporaryFolder folder;
  std::vector<std::string> told;
};

TEST_F(FollowersTest, AreRememberedOverAProcess) {
  auto before = open();
  EXPECT_FALSE(*before.find("relay", 1000));
  before.remember("relay", 1000, behind(3, 7), 4711);
  before.save();
  auto after = open();
  EXPECT_EQ(**after.find("relay", 1000), behind(3, 7));
  EXPECT_EQ(after.status().at("relay").time_s, 4711);
}

TEST_F(FollowersTest, ANameBelongsToTheUserThatTookIt) {
  auto followers = open();
  followers.remember("relay", 1000, behind(1, 1), 0);
  const auto other = followers.find("relay", 1001);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().text(), "rows: found user 1001, expected user 1000, owner of the follower \"relay\"");
  EXPECT_TRUE(followers.find("relay", 0)) << "root may";
}

TEST_F(FollowersTest, AFileOfRubbishIsOneOfNobody) {
  for (const char* rubbish :
       {"", "{", "[1]",
        R"({"format": "prism-followers", "followers": {"a": 1, "b": {"after": 2}, "c": {"after": "x"}}})"}) {
    std::ofstream(folder.file("gyro.csv.followers")) << rubbish;
    auto followers = open();
    EXPECT_FALSE(*followers.find("a", 0)) << rubbish;
  }
}

TEST_F(FollowersTest, WhatIsDeletedUnfetchedIsCountedForEach) {
  auto followers = open();
  followers.remember("slow", 1, behind(2, 10), 0);
  followers.remember("quick", 1, behind(3, 0), 0);
  followers.deleted(2, 60);
  EXPECT_THAT(told, ElementsAre("log: 50 rows of segment 2 were deleted that \"slow\" had not fetched"));
  EXPECT_EQ(followers.status().at("slow").lost_rows, 50u);
  EXPECT_EQ(followers.status().at("quick").lost_rows, 0u);
}

TEST_F(FollowersTest, AConsumerHoldsASegmentUpToALimitAndANameThatIsKeptForWithoutOne) {
  auto followers = open({"relay"});
  ASSERT_TRUE(followers.holder(1, 5)) << "it has not fetched any row yet";
  followers.remember("relay", 1, behind(2, 60), 0);
  EXPECT_FALSE(followers.holder(2, 60));
  const auto hold = followers.holder(2, 61);
  ASSERT_TRUE(hold);
  EXPECT_EQ(hold->consumer, "relay");
  EXPECT_FALSE(hold->limited);
  followers.remember("other", 1, behind(1, 0), 0);
  const auto limited = followers.holder(2, 60);
  ASSERT_TRUE(limited);
  EXPECT_EQ(limited->consumer, "other");
  EXPECT_TRUE(limited->limited);
}

// 7 days and a tenth of the bytes beyond the limits.
TEST(Retention, AConsumerDelaysADeletionUpToALimit) {
  config::LogSegmentSettings settings;
  settings.keep_bytes = 1000;
  settings.keep_days = 10;
  Stored stored{.file = "a", .rows = 1, .bytes = 100, .age_s = 10 * 86400, .all_bytes = 1050};
  EXPECT_TRUE(exceeds_limits(settings, stored));
  EXPECT_EQ(next_deletion(settings, stored)->in_s, 0);
  EXPECT_EQ(next_deletion(settings, stored)->why, NextDeletion::Why::kBytes);
  stored.hold = Hold{"other"};
  EXPECT_EQ(next_deletion(settings, stored)->in_s, 7 * 86400);
  EXPECT_EQ(next_deletion(settings, stored)->why, NextDeletion::Why::kAge);
  EXPECT_EQ(next_deletion(settings, stored)->held_by, "other");
  stored.all_bytes = 1101;
  EXPECT_EQ(next_deletion(settings, stored)->in_s, 0);
  stored.hold = Hold{"relay", false};
  EXPECT_EQ(next_deletion(settings, stored)->in_s, std::nullopt);
  EXPECT_EQ(reason_text(settings, NextDeletion::Why::kDiskFull, "capture"), "the disk is full (capture/when_full)");
}

// Through the log itself: what retention would delete stays until it was fetched.
TEST_F(FollowersTest, RetentionWaitsForWhomTheLogIsKept) {
  config::LogSegmentSettings settings;
  settings.directory = folder.file("log");
  settings.max_bytes = 1000;
  settings.keep_bytes = 2000;
  settings.keep_for = {"relay"};
  LogCounters counters;
  SegmentPolicy policy;
  policy.notice_s = 0;
  std::int64_t now_s = 1000;
  policy.uptime_s = [&now_s] { return now_s; };
  policy.tell = [this](pipeline::Severity, const std::string&, const std::string& what) { told.push_back(what); };
  Problems problems([](auto, auto&, auto&) {});
  RowLog log(settings, "gyro", "# prism TEST data log, format 2\n", counters, problems, policy);
  const auto files = [&] {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(settings.directory))
      count += entry.path().extension() == ".csv" ? 1 : 0;
    return count;
  };
  std::int64_t second = 0;
  const auto write = [&](int rows) {
    for (int i = 0; i < rows; ++i) {
      compensation::CompensatedWindow row;
      row.window.second_mean.second = second++;
      log.append(row, 0);
    }
    log.sync();
  };
  write(100);
  for (int i = 0; i < 100; ++i, ++now_s) log.sync();
  const std::size_t kept = files();
  EXPECT_GT(kept, 8u);
  EXPECT_EQ(log.retention()->next->held_by, "relay");
  EXPECT_THAT(told,
              ElementsAre("log: segments are kept longer than log/keep_mib or log/keep_days because \"relay\" has not "
                          "fetched them; until the disk is full"));
  for (std::string after = "earliest";;) {
    const auto page = log.page({.after = after, .follower = "relay"});
    ASSERT_TRUE(page) << page.error().text;
    if (page->rows == 0) break;
    after = page->after.text();
  }
  write(30);
  for (int i = 0; i < 100; ++i, ++now_s) log.sync();
  EXPECT_LT(files(), kept);
}

}  // namespace
}  // namespace prism::log
