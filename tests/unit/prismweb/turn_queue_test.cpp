// SPDX-License-Identifier: MIT
#include "tools/prismweb/turn_queue.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace prism::prismweb {
namespace {

TEST(TurnQueue, RunsTwoTasksAtATimeInOrder) {
  const auto queue = std::make_shared<TurnQueue>();
  std::vector<int> started;
  std::vector<TurnQueue::End> ends;
  for (int i = 0; i < 5; ++i) {
    queue->run([&, i](const TurnQueue::End& end) {
      started.push_back(i);
      ends.push_back(end);
    });
  }
  EXPECT_EQ(started, (std::vector<int>{0, 1}));
  const TurnQueue::End second = ends[1];
  second();
  EXPECT_EQ(started, (std::vector<int>{0, 1, 2}));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const TurnQueue::End end = ends[i];
    if (i != 1) end();
  }
  EXPECT_EQ(started, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(TurnQueue, TasksThatEndAtOnceDoNotRecurse) {
  const auto queue = std::make_shared<TurnQueue>();
  TurnQueue::End first;
  int done = 0;
  for (int i = 0; i < 2; ++i) queue->run([&](const TurnQueue::End& end) { first = end; });
  for (int i = 0; i < 200000; ++i) {
    queue->run([&](const TurnQueue::End& end) {
      ++done;
      end();
    });
  }
  EXPECT_EQ(done, 0);
  first();
  EXPECT_EQ(done, 200000);
}

}  // namespace
}  // namespace prism::prismweb
