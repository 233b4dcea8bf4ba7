// SPDX-License-Identifier: MIT
#include "tools/prismweb/async_store.hpp"

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <utility>

#include "tests/support/temporary_folder.hpp"

namespace prism::prismweb {
namespace {

constexpr std::int64_t kMidnight = 1795392000;

std::vector<PeriodSummary> seconds_of(std::int64_t from, std::int64_t to) {
  std::vector<PeriodSummary> seconds;
  for (std::int64_t i = from; i < to; ++i) {
    PeriodSummary one;
    one.begin_s = kMidnight + i;
    one.min[kRate] = one.max[kRate] = static_cast<double>(i) + 0.5;
    one.seconds = 1;
    seconds.push_back(one);
  }
  return seconds;
}

class AsyncStoreTest : public ::testing::Test {
 protected:
  std::unique_ptr<AsyncStore> make_store(std::chrono::milliseconds timeout = std::chrono::seconds(10)) {
    return std::make_unique<AsyncStore>(io_, disk_, folder_.file("gyro/z"), timeout);
  }
  AsyncStore::OnChange on_change() {
    return [this](const AsyncStore::Status& status) { changes_.push_back(status); };
  }
  void push(AsyncStore& store, std::int64_t from, std::int64_t to, const std::string& after, bool building = false) {
    store.push(seconds_of(from, to), std::exchange(cursor_, after), after, building);
  }
  // Waits for the disk and runs the callbacks.
  void settle() {
    disk_.drain();
    io_.restart();
    io_.poll();
  }

  test::TemporaryFolder folder_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  DiskThread disk_{0, [](const std::string& why) { ADD_FAILURE() << why; }};
  std::vector<AsyncStore::Status> changes_;
  std::string cursor_;  ///< after the pushed seconds
};

TEST_F(AsyncStoreTest, ReportsTheContentsOfTheStore) {
  const auto store = make_store();
  store->open(on_change());
  push(*store, 0, 100, "after-100");
  push(*store, 100, 200, "after-200");
  settle();
  ASSERT_EQ(changes_.size(), 3U);
  EXPECT_TRUE(changes_[0].open);
  EXPECT_EQ(changes_[0].problem, "") << "a missing directory is not a problem";
  EXPECT_EQ(changes_[2].cursor, "after-200");
  EXPECT_EQ(changes_[2].first_s, kMidnight);
  EXPECT_EQ(changes_[2].last_s, kMidnight + 199);

  std::vector<PeriodSummary> steps;
  std::string cursor;
  const auto take_steps = [&](const Result<AsyncStore::Periods>& found) { steps = found->steps; };
  const auto take_cursor = [&](const Result<std::vector<std::string>>& found) { cursor = found->at(0); };
  store->periods({kMidnight, kMidnight + 200, 120}, take_steps);
  store->cursors_before(kMidnight + 200, take_cursor);
  settle();
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps[0].seconds, 120U);
  EXPECT_EQ(steps[1].max[kRate], 199.5);
  EXPECT_EQ(cursor, "after-200");
}

TEST_F(AsyncStoreTest, CommitsTwentyPagesAtOnceWhileBuilding) {
  const auto committed_cursor = [&] {  // as the next process reads it
    std::filesystem::remove_all(folder_.file("copy"));
    std::filesystem::copy(folder_.file("gyro/z"), folder_.file("copy"));
    return PeriodStore::open(folder_.file("copy"))->cursor();
  };
  const auto store = make_store();
  store->open(on_change());
  for (std::int64_t page = 0; page < 20; ++page) {
    settle();
    EXPECT_EQ(committed_cursor(), "") << page;
    push(*store, page * 60, page * 60 + 60, "page-" + std::to_string(page), true);
  }
  settle();
  EXPECT_EQ(committed_cursor(), "page-19");
  push(*store, 1200, 1210, "live");
  store->commit();
  settle();
  EXPECT_EQ(committed_cursor(), "live");
  EXPECT_EQ(changes_.back().cursor, "live");
}

// A page requested before the store was cleared would leave a gap.
TEST_F(AsyncStoreTest, IgnoresAPageAfterAnotherCursor) {
  const auto store = make_store();
  store->open(on_change());
  push(*store, 0, 60, "after-60");
  store->clear();
  push(*store, 60, 120, "after-120");
  settle();
  EXPECT_EQ(changes_.back().cursor, "");
  EXPECT_EQ(changes_.back().first_s, std::nullopt);
}

TEST_F(AsyncStoreTest, ReportsWhyItCannotOpenOrWasRebuilt) {
  std::ofstream(folder_.file("gyro")) << "a file instead of the directory";
  make_store()->open(on_change());
  settle();
  EXPECT_FALSE(changes_.back().open);
  EXPECT_NE(changes_.back().problem.find("gyro/z"), std::string::npos) << changes_.back().problem;
  std::filesystem::remove(folder_.file("gyro"));
  std::filesystem::create_directories(folder_.file("gyro/z"));
  std::ofstream(folder_.file("gyro/z/periods.sqlite")) << std::string(1000, '{');
  make_store()->open(on_change());
  settle();
  EXPECT_TRUE(changes_.back().open);
  EXPECT_NE(changes_.back().problem.find("periods.sqlite: file is not a database; rebuilding it from the log"),
            std::string::npos)
      << changes_.back().problem;
}

// The record becomes damaged after the store's check at its opening.
TEST_F(AsyncStoreTest, ReportsDamageWhenReadAndRebuilds) {
  auto store = make_store();
  store->open(on_change());
  push(*store, 0, 36000, "after-36000");
  store->commit();
  settle();
  store.reset();
  std::fstream file(folder_.file("gyro/z/periods.sqlite"), std::ios::in | std::ios::out | std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::size_t at =
      bytes.find(std::string("\x40\xd1\xa2\xe0\0\0\0\0", 8));  // 18059.5, the maximum rate of a minute
  ASSERT_NE(at, std::string::npos);
  file.seekp(static_cast<std::streamoff>(at + 7));
  file.put('\1');
  file.close();
  store = make_store();
  store->open(on_change());
  settle();
  EXPECT_EQ(changes_.back().cursor, "after-36000") << "not read yet";
  std::string answer;
  const auto take_steps = [&](const Result<AsyncStore::Periods>& found) { answer = found ? "" : found.error().text(); };
  store->periods({kMidnight, kMidnight + 36000, 60}, take_steps);
  settle();
  EXPECT_NE(answer.find("periods.sqlite: a record is damaged"), std::string::npos) << answer;
  EXPECT_NE(changes_.back().problem.find("a record is damaged; rebuilding it from the log"), std::string::npos);
  EXPECT_EQ(changes_.back().cursor, "");
  cursor_ = "";
  push(*store, 0, 36000, "again");
  push(*store, 36000, 36001, "next");
  store->periods({kMidnight, kMidnight + 36000, 60}, take_steps);
  settle();
  EXPECT_EQ(answer, "");
  EXPECT_EQ(changes_.back().problem, "");
}

TEST_F(AsyncStoreTest, ReportsABlockedDiskInTimeAndOnce) {
  const auto store = make_store(std::chrono::milliseconds(50));
  store->open(on_change());
  settle();
  std::promise<void> answers;
  disk_.post(0, [until = answers.get_future().share()] { until.wait(); });
  std::vector<std::string> found;
  const auto take = [&](const Result<std::vector<std::string>>& cursors) {
    found.push_back(cursors ? std::to_string(cursors->size()) : cursors.error().what);
  };
  store->cursors_before(0, take);
  io_.run_for(std::chrono::milliseconds(500));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0], "the disk has not answered for 0 s");
  store->cursors_before(0, take);  // known to be blocked: fails at once
  io_.restart();
  io_.poll();
  EXPECT_EQ(found.size(), 2U);
  answers.set_value();
  settle();
  EXPECT_EQ(found.size(), 2U) << "a late result is ignored";
  store->cursors_before(0, take);
  settle();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[2], "0");
}

}  // namespace
}  // namespace prism::prismweb
