// SPDX-License-Identifier: MIT
#include "tools/prismweb/send_queue.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace prism::prismweb {
namespace {

std::string lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) {
  return nlohmann::json({{"instance", instance}, {"rows", rows}, {"rows_total", rows_total}}).dump();
}

Text text_of(std::size_t bytes) { return std::make_shared<const std::string>(bytes, 'x'); }

TEST(SendQueue, DropsAndCountsUntilTheQueueIsEmpty) {
  SendQueue queue(std::make_shared<AnswerMemory>(), lost_text);
  const Text large = text_of(SendQueue::kMaxBatchBytes / 2);
  for (int i = 0; i < 5; ++i) queue.batch("g", large, 10);
  EXPECT_EQ(queue.bytes(), SendQueue::kMaxBatchBytes);
  queue.take();
  queue.batch("g", text_of(1), 1);  // it would fit, but one gap is reported, not two
  queue.batch("h", text_of(1), 2);
  EXPECT_EQ(queue.take(), large);
  std::vector<nlohmann::json> lost;
  while (!queue.empty()) lost.push_back(nlohmann::json::parse(*queue.take()));
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(lost[0], nlohmann::json({{"instance", "g"}, {"rows", 31}, {"rows_total", 31}}));
  EXPECT_EQ(lost[1], nlohmann::json({{"instance", "h"}, {"rows", 2}, {"rows_total", 2}}));
  queue.batch("g", text_of(1), 1);
  EXPECT_EQ(queue.take()->size(), 1U) << "accepts batches again";
  EXPECT_TRUE(queue.empty());
}

TEST(SendQueue, AnEmptyQueueAcceptsAnOversizedBatch) {
  SendQueue queue(std::make_shared<AnswerMemory>(), lost_text);
  queue.batch("g", text_of(SendQueue::kMaxBatchBytes + 1), 10);
  EXPECT_FALSE(queue.empty());
}

TEST(SendQueue, TooManyResponsesDisconnectTheClient) {
  SendQueue queue(std::make_shared<AnswerMemory>(), lost_text);
  const Text large = text_of(SendQueue::kMaxBatchBytes);
  int queued = 0;
  while (queue.answer(large)) ++queued;
  EXPECT_EQ(queued, 9);
}

// 60 clients that do not read their responses used 16 MiB each, more than the service's memory limit.
TEST(SendQueue, LimitsTheMemoryOfAllClients) {
  const auto memory = std::make_shared<AnswerMemory>();
  std::vector<std::unique_ptr<SendQueue>> greedy;
  const Text large = text_of(1 << 20);
  std::size_t queued = 0;
  for (int i = 0; i < 60; ++i) {
    greedy.push_back(std::make_unique<SendQueue>(memory, lost_text));
    while (greedy.back()->answer(large)) ++queued;
  }
  EXPECT_LT(queued << 20, SendQueue::kMaxAllBytes + 60 * (SendQueue::kGuaranteedBytes + 2 * large->size()));
  SendQueue modest(memory, lost_text);
  EXPECT_TRUE(modest.answer(large)) << "a client that reads is served";
  greedy.clear();
  int alone = 0;
  while (modest.answer(large)) ++alone;
  EXPECT_EQ(alone, 16);
}

}  // namespace
}  // namespace prism::prismweb
