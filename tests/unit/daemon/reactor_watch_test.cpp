// SPDX-License-Identifier: MIT
// A read must be interrupted for what rings, whenever it began, and nothing else must be.
#include "daemon/reactor_watch.hpp"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <thread>

namespace prism::daemon {
namespace {

using std::chrono::milliseconds;

struct Descriptors : testing::Test {
  Descriptors() { EXPECT_EQ(::pipe(line.data()), 0); }
  ~Descriptors() override {
    for (const int fd : {event, line[0], line[1]}) ::close(fd);
  }
  int read_line() {
    char byte = 0;
    return ::read(line[0], &byte, 1) < 0 ? errno : 0;
  }
  int event = ::eventfd(0, EFD_CLOEXEC);
  std::array<int, 2> line{};
};

using ReactorWatchTest = Descriptors;

TEST_F(ReactorWatchTest, InterruptsARead) {
  ReactorWatch watch(event);
  std::thread other([&] {
    std::this_thread::sleep_for(milliseconds(10));
    ::eventfd_write(event, 1);
  });
  watch.begin_read();
  EXPECT_EQ(read_line(), EINTR);
  watch.end_read();
  EXPECT_TRUE(watch.rung());
  other.join();
}

TEST_F(ReactorWatchTest, InterruptsAReadThatBeginsAfterItRang) {
  ReactorWatch watch(event);
  ::eventfd_write(event, 1);
  while (!watch.rung()) std::this_thread::yield();
  std::this_thread::sleep_for(milliseconds(5));
  watch.begin_read();
  EXPECT_EQ(read_line(), EINTR);
  watch.end_read();
}

TEST_F(ReactorWatchTest, LeavesOtherCallsAlone) {
  ReactorWatch watch(event);
  ::eventfd_write(event, 1);
  while (!watch.rung()) std::this_thread::yield();
  timespec nap{0, 20'000'000};
  EXPECT_EQ(::nanosleep(&nap, nullptr), 0) << "a sleep outside of the read was interrupted";
}

TEST_F(ReactorWatchTest, RingsAgainOnlyForWhatIsThereAfterTheAnswer) {
  ReactorWatch watch(event);
  ::eventfd_write(event, 1);
  while (!watch.rung()) std::this_thread::yield();
  eventfd_t rings = 0;
  ::eventfd_read(event, &rings);
  watch.answer();
  std::this_thread::sleep_for(milliseconds(5));
  EXPECT_FALSE(watch.rung());
  ::eventfd_write(event, 1);
  watch.begin_read();
  EXPECT_EQ(read_line(), EINTR);
  watch.end_read();
}

TEST_F(ReactorWatchTest, EndsWhileItRings) {
  ::eventfd_write(event, 1);
  for (int i = 0; i < 20; ++i) const ReactorWatch watch(event);
}

}  // namespace
}  // namespace prism::daemon
