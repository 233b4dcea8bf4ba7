// SPDX-License-Identifier: MIT
// DiskThread: order, bounded queue, exceptions of tasks.
#include "base/disk_thread.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <vector>

#include "tests/support/disk_files.hpp"

namespace prism {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Blocks the thread until it is released.
class Held {
 public:
  explicit Held(DiskThread& disk) {
    disk.post(0, [open = gate_.get_future().share()] { open.wait(); });
  }
  void let_go() { gate_.set_value(); }

 private:
  std::promise<void> gate_;
};

TEST(DiskThread, RejectsDataIfItsQueueIsFullButNeverATaskWithoutData) {
  test::Told told;
  int ran = 0;  // outlives the thread, which runs the last task at its end
  DiskThread disk(100, told.teller());
  Held held(disk);
  const auto task = [&ran] { ++ran; };
  EXPECT_TRUE(disk.post(60, task));
  EXPECT_FALSE(disk.post(41, task));
  EXPECT_TRUE(disk.post(40, task));
  EXPECT_FALSE(disk.post(1, task));
  EXPECT_TRUE(disk.post(0, task));
  held.let_go();
  disk.drain();
  EXPECT_EQ(ran, 3);
  EXPECT_TRUE(disk.post(100, task)) << "there is room again";
}

TEST(DiskThread, RunsQueuedTasksInOrderBeforeItEnds) {
  test::Told told;
  std::vector<int> order, expected;
  {
    DiskThread disk(100, told.teller());
    Held held(disk);
    for (int i = 0; i < 100; ++i) disk.post(1, [&order, i] { order.push_back(i); }), expected.push_back(i);
    held.let_go();
  }
  EXPECT_EQ(order, expected);
}

// Regression: std::filesystem threw on this thread, and prismd aborted (SIGABRT).
TEST(DiskThread, ContinuesAfterATaskThatThrows) {
  test::Told told;
  DiskThread disk(100, told.teller());
  int ran = 0;
  disk.post(100, [] { throw std::runtime_error("stale file handle"); });
  disk.drain();
  EXPECT_TRUE(disk.post(100, [] { throw 1; })) << "its bytes are free again";
  disk.post(0, [&ran] { ++ran; });
  disk.drain();
  EXPECT_EQ(ran, 1);
  EXPECT_THAT(told.lines(), ElementsAre("stale file handle", "an exception of unknown type"));
}

TEST(DiskThread, ReportsAThrowingTaskToItsOwnerAndContinuesIfTheReportThrows) {
  test::Told told, owner;
  int ran = 0;
  DiskThread disk(100, told.teller());
  const auto fail = [] { throw std::bad_alloc(); };
  disk.post(10, fail, owner.teller());
  disk.post(
      10, [&ran] { ++ran; }, owner.teller());
  disk.post(10, fail, [](const std::string&) { throw std::bad_alloc(); });
  disk.post(0, [&ran] { ++ran; });
  disk.drain();
  EXPECT_EQ(owner.lines().size(), 1u);
  EXPECT_THAT(told.lines(), IsEmpty());
  EXPECT_EQ(ran, 2);
  DiskThread silent(100, [](const std::string&) { throw std::bad_alloc(); });
  silent.post(0, fail);
  silent.post(0, [&ran] { ++ran; });
  silent.drain();
  EXPECT_EQ(ran, 3);
}

TEST(DiskThread, DestroysATaskBeforeTheNextOneRuns) {
  test::Told told;
  DiskThread disk(100, told.teller());
  auto held = std::make_shared<int>(1);
  std::weak_ptr<int> watch = held;
  bool gone = false;
  disk.post(0, [held = std::move(held)] { throw std::runtime_error("failed"); });
  disk.post(0, [&] { gone = watch.expired(); });
  disk.drain();
  EXPECT_TRUE(gone);
}

}  // namespace
}  // namespace prism
