// SPDX-License-Identifier: MIT
#include "tools/prismweb/store_keeper.hpp"

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <fstream>
#include <future>

#include "tests/support/temporary_folder.hpp"

namespace prism::prismweb {
namespace {

constexpr std::int64_t kMidnight = 1795392000;

std::vector<Extremes> seconds_of(std::int64_t from, std::int64_t to) {
  std::vector<Extremes> seconds;
  for (std::int64_t i = from; i < to; ++i) {
    Extremes one;
    one.begin_s = kMidnight + i;
    one.least[kRate] = one.greatest[kRate] = static_cast<double>(i);
    one.seconds = 1;
    seconds.push_back(one);
  }
  return seconds;
}

class Keeping : public ::testing::Test {
 protected:
  std::unique_ptr<StoreKeeper> keeper(std::chrono::milliseconds patience = std::chrono::seconds(10)) {
    return std::make_unique<StoreKeeper>(io_, disk_, folder_.file("gyro/z"), patience);
  }
  StoreKeeper::Told teller() {
    return [this](const StoreKeeper::Known& known) { told_.push_back(known); };
  }
  // What the disk has done so far is told.
  void settle() {
    disk_.drain();
    io_.restart();
    io_.poll();
  }

  test::TemporaryFolder folder_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  DiskThread disk_{0, [](const std::string& why) { ADD_FAILURE() << why; }};
  std::vector<StoreKeeper::Known> told_;
};

TEST_F(Keeping, TellsWhatTheStoreHas) {
  const auto store = keeper();
  store->open(teller());
  store->take(seconds_of(0, 200), "after-200", false, teller());
  settle();
  ASSERT_EQ(told_.size(), 2U);
  EXPECT_TRUE(told_[0].open);
  EXPECT_EQ(told_[0].trouble, "") << "a folder that was not there is no trouble";
  EXPECT_EQ(told_[1].cursor, "after-200");
  EXPECT_EQ(told_[1].first_s, kMidnight);
  EXPECT_EQ(told_[1].last_s, kMidnight + 199);

  std::vector<Extremes> steps;
  std::string cursor;
  const auto take_steps = [&](const Result<StoreKeeper::Periods>& found) { steps = found->steps; };
  const auto take_cursor = [&](const Result<std::vector<std::string>>& found) { cursor = found->at(0); };
  store->periods({kMidnight, kMidnight + 200, 120, false}, take_steps);
  store->cursors_before(kMidnight + 200, take_cursor);
  settle();
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps[0].seconds, 120U);
  EXPECT_EQ(steps[1].greatest[kRate], 199);
  EXPECT_EQ(cursor, "after-200");
}

TEST_F(Keeping, PagesOfALogThatIsReadFromItsBeginningAreKeptTogether) {
  const auto store = keeper();
  store->open(teller());
  for (std::int64_t page = 0; page < 20; ++page)
    store->take(seconds_of(page * 60, page * 60 + 60), "page-" + std::to_string(page), true, teller());
  settle();
  ASSERT_EQ(told_.size(), 21U);
  EXPECT_EQ(told_[19].cursor, "");
  EXPECT_EQ(told_[20].cursor, "page-19");
  store->take(seconds_of(1200, 1210), "live", false, teller());
  store->keep("live");
  settle();
  const auto again = keeper();
  again->open(teller());
  settle();
  EXPECT_EQ(told_.back().cursor, "live");
}

TEST_F(Keeping, SaysWhatItCannotOpenAndWhyItBeganAnew) {
  std::ofstream(folder_.file("gyro")) << "a file where the folder is to be";
  keeper()->open(teller());
  settle();
  EXPECT_FALSE(told_.back().open);
  EXPECT_NE(told_.back().trouble.find("gyro/z"), std::string::npos) << told_.back().trouble;
  std::filesystem::remove(folder_.file("gyro"));
  std::filesystem::create_directories(folder_.file("gyro/z"));
  std::ofstream(folder_.file("gyro/z/place.json")) << "{";
  keeper()->open(teller());
  settle();
  EXPECT_TRUE(told_.back().open);
  EXPECT_NE(told_.back().trouble.find("place.json"), std::string::npos) << told_.back().trouble;
}

TEST_F(Keeping, ADiskThatHangsIsToldInTimeAndOnce) {
  const auto store = keeper(std::chrono::milliseconds(50));
  store->open(teller());
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
  EXPECT_EQ(found[0], "has not answered for 0 s");
  store->cursors_before(0, take);  // it hangs: that is known without waiting
  io_.restart();
  io_.poll();
  EXPECT_EQ(found.size(), 2U);
  answers.set_value();
  settle();
  EXPECT_EQ(found.size(), 2U) << "an answer that comes too late is none";
  store->cursors_before(0, take);
  settle();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[2], "0");
}

}  // namespace
}  // namespace prism::prismweb
