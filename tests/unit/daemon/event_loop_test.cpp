// SPDX-License-Identifier: MIT
// The loop waits outside of Asio: whatever Asio would have been woken by must wake it all the same.
#include "daemon/event_loop.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <string>
#include <thread>

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;

class Pipe : public UrgentSource {
 public:
  Pipe() { EXPECT_EQ(::pipe(ends_.data()), 0); }
  ~Pipe() override {
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  bool listening() const override { return heeded; }
  ssize_t read() override { return ::read(ends_[0], &byte_, 1); }
  void received(ssize_t size, int error) override {
    ASSERT_EQ(size, 1) << error;
    heard += byte_;
    if (on_byte) on_byte();
  }
  void say(char byte) { ASSERT_EQ(::write(ends_[1], &byte, 1), 1); }

  bool heeded = true;
  std::string heard;
  std::function<void()> on_byte;

 private:
  std::array<int, 2> ends_{};
  char byte_ = 0;
};

TEST(EventLoop, ReadsTheSourceOnceForEachTimeItIsReadable) {
  EventLoop loop;
  Pipe pipe;
  pipe.on_byte = [&] { pipe.heard.size() < 3 ? pipe.say('b') : loop.stop(); };
  pipe.say('a');
  loop.run(pipe);
  EXPECT_EQ(pipe.heard, "abb");
}

TEST(EventLoop, RunsWhatWasPostedBeforeItRan) {
  EventLoop loop;
  Pipe pipe;
  asio::post(loop.io(), [&] { loop.stop(); });
  loop.run(pipe);
  EXPECT_EQ(pipe.heard, "");
}

TEST(EventLoop, IsWokenByAnotherThreadsPost) {
  EventLoop loop;
  Pipe pipe;
  std::thread other([&] {
    std::this_thread::sleep_for(
        milliseconds(20));  // the loop waits by now; where it does not, the test is merely easier
    loop.post([&] { loop.stop(); });
  });
  loop.run(pipe);
  other.join();
}

TEST(EventLoop, IsWokenByATimerAndByASocket) {
  EventLoop loop;
  Pipe pipe;
  pipe.heeded = false;
  asio::local::stream_protocol::socket ours(loop.io()), theirs(loop.io());
  asio::local::connect_pair(ours, theirs);
  std::array<char, 8> buffer{};
  std::size_t received = 0;
  ours.async_read_some(asio::buffer(buffer), [&](auto, std::size_t size) {
    received = size;
    loop.stop();
  });
  asio::steady_timer timer(loop.io(), milliseconds(5));
  timer.async_wait([&](auto) { ASSERT_EQ(::write(theirs.native_handle(), "abc", 3), 3); });
  loop.run(pipe);
  EXPECT_EQ(received, 3u);
}

TEST(EventLoop, ASilentSourceIsLeftForATimer) {
  EventLoop loop;
  Pipe pipe;
  asio::steady_timer timer(loop.io(), milliseconds(5));
  timer.async_wait([&](auto) { pipe.say('a'); });
  pipe.on_byte = [&] { loop.stop(); };
  loop.run(pipe);
  EXPECT_EQ(pipe.heard, "a");
}

TEST(EventLoop, ASourceThatStartsToListenIsHeard) {
  EventLoop loop;
  Pipe pipe;
  pipe.heeded = false;
  pipe.say('a');
  pipe.on_byte = [&] { loop.stop(); };
  asio::steady_timer timer(loop.io(), milliseconds(5));
  timer.async_wait([&](auto) { pipe.heeded = true; });
  loop.run(pipe);
  EXPECT_EQ(pipe.heard, "a");
}

TEST(EventLoop, RunsHandlersThatHandlersPost) {
  EventLoop loop;
  Pipe pipe;
  int depth = 0;
  std::function<void()> deeper = [&] { ++depth < 5 ? asio::post(loop.io(), deeper) : loop.stop(); };
  loop.post(deeper);
  loop.run(pipe);
  EXPECT_EQ(depth, 5);
}

TEST(EventLoop, ABusySourceDoesNotStarveTheRest) {
  EventLoop loop;
  Pipe pipe;
  pipe.on_byte = [&] { pipe.say('x'); };  // readable for ever
  pipe.say('x');
  asio::steady_timer timer(loop.io(), milliseconds(5));
  timer.async_wait([&](auto) { loop.stop(); });
  loop.run(pipe);
  EXPECT_GT(pipe.heard.size(), 1u);
}

}  // namespace
}  // namespace prism::daemon
