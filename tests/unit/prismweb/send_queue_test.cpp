// SPDX-License-Identifier: MIT
#include "tools/prismweb/send_queue.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "tools/prismweb/turn_queue.hpp"

namespace prism::prismweb {
namespace {

std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) {
  return nlohmann::json({{"instance", instance}, {"rows", rows}, {"rows_total", rows_total}}).dump();
}

Text text_of(std::size_t bytes) { return std::make_shared<const std::string>(bytes - SendQueue::kTextBytes, 'x'); }

struct TestClient {
  explicit TestClient(const std::shared_ptr<UnsentMemory>& memory)
      : queue(
            memory, [this] { closed = true; }, lost_text) {}
  Text send() {
    Text text = queue.take();
    queue.sent();
    return text;
  }
  bool closed = false;
  SendQueue queue;
};

TEST(SendQueue, DropsAndCountsUntilTheQueueIsEmpty) {
  TestClient client(std::make_shared<UnsentMemory>());
  SendQueue& queue = client.queue;
  const Text large = text_of(SendQueue::kMaxBatchBytes / 2);
  for (int i = 0; i < 5; ++i) queue.batch("g", large, 10);
  EXPECT_EQ(queue.bytes(), SendQueue::kMaxBatchBytes);
  client.send();
  queue.batch("g", text_of(200), 1);  // it would fit, but one gap is reported, not two
  queue.batch("h", text_of(200), 2);
  EXPECT_EQ(client.send(), large);
  std::vector<nlohmann::json> lost;
  while (!queue.empty()) lost.push_back(nlohmann::json::parse(*client.send()));
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(lost[0], nlohmann::json({{"instance", "g"}, {"rows", 31}, {"rows_total", 31}}));
  EXPECT_EQ(lost[1], nlohmann::json({{"instance", "h"}, {"rows", 2}, {"rows_total", 2}}));
  queue.batch("g", text_of(201), 1);
  EXPECT_EQ(client.send()->size(), 201 - SendQueue::kTextBytes) << "accepts batches again";
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0U);
}

TEST(SendQueue, AnEmptyQueueAcceptsAnOversizedBatch) {
  TestClient client(std::make_shared<UnsentMemory>());
  client.queue.batch("g", text_of(SendQueue::kMaxBatchBytes + 1000), 10);
  EXPECT_FALSE(client.queue.empty());
}

TEST(SendQueue, TooManyResponsesDisconnectTheClient) {
  TestClient client(std::make_shared<UnsentMemory>());
  const Text large = text_of(SendQueue::kMaxBatchBytes);
  int queued = 0;
  while (client.queue.answer(large)) ++queued;
  EXPECT_EQ(queued, 9);
}

// Each of a million short responses used twice its size.
TEST(SendQueue, PausesAClientThatDoesNotReadItsResponses) {
  const auto memory = std::make_shared<UnsentMemory>();
  TestClient client(memory);
  const Text small = std::make_shared<const std::string>("{}");
  std::size_t queued = 0;
  for (; !client.queue.is_paused(); ++queued) ASSERT_TRUE(client.queue.answer(small));
  EXPECT_LE(queued, SendQueue::kPauseBytes / SendQueue::kTextBytes);
  EXPECT_EQ(client.queue.take(), small);
  EXPECT_TRUE(client.queue.is_paused()) << "the text is not sent yet";
  EXPECT_EQ(memory->bytes(), queued * (2 + SendQueue::kTextBytes));
  client.queue.sent();
  EXPECT_FALSE(client.queue.is_paused());
  EXPECT_EQ(memory->bytes(), (queued - 1) * (2 + SendQueue::kTextBytes));
  for (int i = 0; i < 20000; ++i) client.queue.batch("g", small, 1);
  EXPECT_FALSE(client.queue.is_paused()) << "by rows, which are dropped instead";
}

// 60 clients that do not read their responses used 16 MiB each, more than the service's memory limit; the limit of all
// clients excluded 2 MiB per client and the text that was being sent.
TEST(SendQueue, TheLargestQueueIsClosedAboveTheLimit) {
  const auto memory = std::make_shared<UnsentMemory>();
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int i = 0; i < 62; ++i) clients.push_back(std::make_unique<TestClient>(memory));
  const Text two = text_of(2 << 20), four = text_of(4 << 20);
  for (const auto& client : clients) {
    client->queue.answer(two);
    client->queue.take();  // begins to send
  }
  TestClient& greedy = *clients[30];
  greedy.queue.answer(two);
  EXPECT_EQ(memory->bytes(), 126U << 20);
  EXPECT_FALSE(greedy.closed);
  TestClient modest(memory);
  modest.queue.answer(four);
  EXPECT_TRUE(greedy.closed || modest.closed);
  EXPECT_FALSE(clients[0]->closed);
  clients[0]->queue.answer(four);
  EXPECT_LE(memory->bytes(), UnsentMemory::kMaxBytes);
  EXPECT_TRUE(greedy.queue.empty() || modest.queue.empty());
  greedy.queue.sent();  // the write fails after it was closed
  clients.clear();
  EXPECT_EQ(memory->bytes(), modest.closed ? 0U : 4U << 20);
}

TEST(UnsentMemory, ClosesOnlyAsManyAsNeeded) {
  const auto memory = std::make_shared<UnsentMemory>();
  std::vector<int> closed;
  std::vector<std::unique_ptr<UnsentMemory::Part>> parts;
  for (int i = 0; i < 4; ++i) {
    parts.push_back(std::make_unique<UnsentMemory::Part>(memory, [&closed, i] { closed.push_back(i); }));
    parts.back()->add(static_cast<std::size_t>(i + 1) << 20);
  }
  parts[0]->add(UnsentMemory::kMaxBytes - (10U << 20));
  EXPECT_EQ(closed, std::vector<int>());
  EXPECT_EQ(memory->bytes(), UnsentMemory::kMaxBytes);
  parts[1]->add(1);
  EXPECT_EQ(closed, std::vector<int>{0}) << "the largest, not the last one";
  EXPECT_EQ(memory->bytes(), (9U << 20) + 1);
  parts[0]->add(5);
  parts[0]->remove(5);
  EXPECT_EQ(memory->bytes(), (9U << 20) + 1) << "a closed one is not counted";
  parts[3]->remove(1 << 20);
  parts.clear();
  EXPECT_EQ(memory->bytes(), 0U);
  EXPECT_EQ(closed.size(), 1U);
}

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
