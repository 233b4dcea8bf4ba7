// SPDX-License-Identifier: MIT
// Messages are written in order; if stderr is blocked, no caller waits, and the loss is reported.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <ctime>
#include <regex>

#include "daemon/logging.hpp"

namespace prism::daemon {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

struct MessageThreadTest : testing::Test {
  void SetUp() override { ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0); }
  std::string read_some() const {
    std::string text(1 << 17, '\0');
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(::read(ends[0], text.data(), text.size()), 0)));
    return text;
  }
  int ends[2];  // never closed: a thread that hangs keeps them
};

TEST_F(MessageThreadTest, WritesInOrder) {
  MessageThread messages(ends[1]);
  for (int i = 0; i < 100; ++i) messages.put(std::to_string(i) + "\n");
  EXPECT_TRUE(messages.finish(milliseconds(5000)));
  const std::string text = read_some();
  EXPECT_THAT(text, testing::StartsWith("0\n1\n2\n"));
  EXPECT_THAT(text, testing::EndsWith("98\n99\n"));
}

// Earlier bug: with a blocked pipe as stderr, acquisition, responses and SIGTERM handling blocked in write(2).
TEST_F(MessageThreadTest, DoesNotWaitForABlockedReader) {
  const auto begin = std::chrono::steady_clock::now();
  {
    MessageThread messages(ends[1]);
    for (int i = 0; i < 5000; ++i) messages.put(std::string(199, 'x') + "\n");
    EXPECT_FALSE(messages.finish(milliseconds(50)));
    const std::regex report("prismd: lost ([0-9]+) messages: stderr was blocked\n");
    std::string text;
    int lost = 0;  // of all reports: the queue may have had room once between the messages
    while (lost <= 3000 && std::chrono::steady_clock::now() - begin < std::chrono::seconds(20)) {
      messages.put("again\n");
      text += read_some();
      lost = 0;
      for (std::sregex_iterator at(text.begin(), text.end(), report), end; at != end; ++at) lost += std::stoi((*at)[1]);
    }
    EXPECT_GT(lost, 3000);
    messages.put(std::string(1 << 18, 'y'));  // it blocks again, but the destructor does not
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

// Of a terminal that another program made non-blocking.
TEST_F(MessageThreadTest, WaitsWithoutComputingForADescriptorThatIsFull) {
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, O_NONBLOCK), 0);
  MessageThread messages(ends[1]);
  const std::string line = std::string((1 << 17) - 1, 'x') + "\n";  // more than a pipe holds
  messages.put(line);
  const std::clock_t begin = std::clock();
  EXPECT_FALSE(messages.finish(milliseconds(100)));
  EXPECT_LT(std::clock() - begin, CLOCKS_PER_SEC / 100);
  std::string text;
  while (text.size() < line.size()) text += read_some();
  EXPECT_EQ(text, line);
  EXPECT_TRUE(messages.finish(milliseconds(5000)));
}

TEST_F(MessageThreadTest, IgnoresAClosedReader) {
  std::signal(SIGPIPE, SIG_IGN);
  ::close(ends[0]);
  MessageThread messages(ends[1]);
  messages.put("unread\n");
  messages.put("unread\n");
  EXPECT_TRUE(messages.finish(milliseconds(5000)));
}

}  // namespace
}  // namespace prism::daemon
