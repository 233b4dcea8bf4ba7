// SPDX-License-Identifier: MIT
#include "tools/prismweb/server.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

namespace prism::prismweb {
namespace {

Text text_of(std::size_t bytes) { return std::make_shared<const std::string>(bytes - SendQueue::kTextBytes, 'x'); }

struct TestClient {
  explicit TestClient(const std::shared_ptr<Connections>& all)
      : connection(std::make_shared<Connection>(all, -1)), queue(connection) {}
  Text send() {
    Text text = queue.front();
    queue.pop();
    return text;
  }
  std::shared_ptr<Connection> connection;
  SendQueue queue;
};

TEST(SendQueue, DropsAndCountsUntilTheBatchesAreSent) {
  const auto all = std::make_shared<Connections>();
  TestClient client(all);
  SendQueue& queue = client.queue;
  const Text large = text_of(SendQueue::kMaxBatchBytes / 2);
  for (int i = 0; i < 5; ++i) queue.put_batch("g", large, 10);
  EXPECT_EQ(queue.bytes(), SendQueue::kMaxBatchBytes);
  client.send();
  queue.put_batch("g", text_of(200), 1);  // it would fit, but one gap is reported, not two
  queue.put_batch("h", text_of(200), 2);
  EXPECT_EQ(client.send(), large);
  std::vector<nlohmann::json> lost;
  while (!queue.empty()) lost.push_back(nlohmann::json::parse(*client.send())["params"]);
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(lost[0], nlohmann::json({{"instance", "g"}, {"rows", 31}, {"rows_total", 31}}));
  EXPECT_EQ(lost[1], nlohmann::json({{"instance", "h"}, {"rows", 2}, {"rows_total", 2}}));
  queue.put_batch("g", text_of(201), 1);
  EXPECT_EQ(client.send()->size(), 201 - SendQueue::kTextBytes) << "accepts batches again";
  EXPECT_EQ(queue.bytes(), 0U);
  EXPECT_EQ(all->unsent_bytes(), 0U);
}

TEST(SendQueue, AnEmptyQueueAcceptsAnOversizedBatch) {
  TestClient client(std::make_shared<Connections>());
  client.queue.put_batch("g", text_of(SendQueue::kMaxBatchBytes + 1000), 10);
  EXPECT_FALSE(client.queue.empty());
}

// Each of a million short responses used twice its size.
TEST(SendQueue, PausesAClientThatDoesNotReadItsResponses) {
  const auto all = std::make_shared<Connections>();
  TestClient client(all);
  const Text small = std::make_shared<const std::string>("{}");
  client.queue.put(text_of(SendQueue::kMaxResponseBytes), SendQueue::kLong);
  EXPECT_TRUE(client.queue.is_sending_long());
  EXPECT_FALSE(client.queue.is_paused()) << "by a long response, after which the next one waits";
  std::size_t queued = 0;
  for (; !client.queue.is_paused(); ++queued) client.queue.put(small, SendQueue::kResponse);
  EXPECT_LE(queued, SendQueue::kPauseBytes / SendQueue::kTextBytes);
  client.send();
  EXPECT_FALSE(client.queue.is_sending_long());
  client.send();
  EXPECT_FALSE(client.queue.is_paused());
  EXPECT_EQ(all->unsent_bytes(), (queued - 1) * (2 + SendQueue::kTextBytes));
  for (int i = 0; i < 20000; ++i) client.queue.put_batch("g", small, 1);
  EXPECT_FALSE(client.queue.is_paused()) << "by rows, which are dropped instead";
}

TEST(SendQueue, KeepsOnlyTheLatestList) {
  TestClient client(std::make_shared<Connections>());
  std::vector<Text> lists;
  for (std::size_t i = 0; i < 5; ++i) client.queue.put(lists.emplace_back(text_of(1000 + i)), SendQueue::kList);
  EXPECT_EQ(client.queue.bytes(), 1000U + 1004U) << "the first may be being sent";
  EXPECT_EQ(client.send(), lists[0]);
  EXPECT_EQ(client.send(), lists[4]);
  EXPECT_EQ(client.queue.bytes(), 0U);
}

// A client that never reads: the parts are below the limit of docs/protocol.md, 4 MiB.
TEST(SendQueue, ADeafClientCostsAtMostFourMebibytes) {
  constexpr std::size_t kShort = 32 * (16 << 10);  // the responses of all requests that may be pending
  EXPECT_LE(SendQueue::kMaxBatchBytes + SendQueue::kMaxResponseBytes + SendQueue::kPauseBytes + kShort, 4U << 20);
}

TEST(Connections, CloseTheOneWithTheMostUnreadData) {
  const auto all = std::make_shared<Connections>();
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
  std::vector<std::unique_ptr<Connection>> open;
  for (std::size_t i = 0; i < 4; ++i) {
    open.push_back(std::make_unique<Connection>(all, i == 0 ? pair[0] : -1));
    open.back()->add_unsent((i + 1) << 20);
  }
  open[0]->add_unsent(Connections::kMaxUnsentBytes - (10U << 20));
  EXPECT_EQ(all->unsent_bytes(), Connections::kMaxUnsentBytes);
  open[1]->add_unsent(1);
  char byte = 0;
  EXPECT_EQ(::recv(pair[1], &byte, 1, MSG_DONTWAIT), 0) << "the largest is closed, not the last one";
  EXPECT_EQ(all->unsent_bytes(), (9U << 20) + 1);
  open[0]->add_unsent(5);
  open[0]->remove_unsent(5);
  EXPECT_EQ(all->unsent_bytes(), (9U << 20) + 1) << "a closed one is not counted";
  open.clear();
  EXPECT_EQ(all->unsent_bytes(), 0U);
}

TEST(Connections, CloseTheOldestOfAnUnknownClientAtTheLimit) {
  const auto all = std::make_shared<Connections>();
  std::vector<std::unique_ptr<Connection>> open;
  int pair[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
  char byte = 0;
  for (std::size_t i = 0; i < 127; ++i) open.push_back(std::make_unique<Connection>(all, i == 2 ? pair[0] : -1));
  open[0]->is_known = open[1]->is_known = true;
  EXPECT_TRUE(all->make_room());
  EXPECT_EQ(::recv(pair[1], &byte, 1, MSG_DONTWAIT), -1) << "below the limit";
  open.push_back(std::make_unique<Connection>(all, -1));
  EXPECT_TRUE(all->make_room());
  EXPECT_EQ(::recv(pair[1], &byte, 1, MSG_DONTWAIT), 0);
  for (const auto& one : open) one->is_known = true;
  open.push_back(std::make_unique<Connection>(all, -1));
  open.back()->is_known = true;
  EXPECT_FALSE(all->make_room()) << "known clients stay";
}

}  // namespace
}  // namespace prism::prismweb
