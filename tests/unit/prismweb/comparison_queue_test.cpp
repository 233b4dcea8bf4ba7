// SPDX-License-Identifier: MIT
#include "tools/prismweb/comparison_queue.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

constexpr SteadyTime kBeginning{};

std::string address_taken(ComparisonQueue& queue, SteadyTime now) {
  const auto key = queue.take(now);
  return key ? key->first : "none";
}

TEST(ComparisonQueue, ComparesAddressesWithoutFailuresFirst) {
  ComparisonQueue queue;
  queue.addresses().failed("guesser", kBeginning);
  queue.addresses().failed("older guesser", kBeginning - std::chrono::seconds(5));
  const SteadyTime now = kBeginning + std::chrono::seconds(1);
  queue.addresses().seen("client", now - std::chrono::seconds(1));
  for (const char* address : {"guesser", "newer client", "older guesser", "client"}) queue.add({address, "x"}, now);
  for (const char* address : {"newer client", "client", "older guesser", "guesser", "none"})
    EXPECT_EQ(address_taken(queue, now), address);
}

TEST(ComparisonQueue, DoublesTheDelayWithEachFailure) {
  ComparisonQueue queue;
  SteadyTime now = kBeginning;
  for (const int delay_s : {1, 2, 4, 8, 8}) {
    queue.addresses().failed("guesser", now);
    EXPECT_TRUE(queue.add({"guesser", "x"}, now));
    EXPECT_EQ(queue.next_time(now), now + std::chrono::seconds(delay_s));
    EXPECT_FALSE(queue.take(now + std::chrono::seconds(delay_s) - std::chrono::milliseconds(1)));
    now += std::chrono::seconds(delay_s);
    EXPECT_TRUE(queue.take(now));
  }
  queue.addresses().succeeded("guesser");
  queue.add({"guesser", "x"}, now);
  EXPECT_TRUE(queue.take(now)) << "a correct password ends the delay";
}

// 100 guessers without pause, 100 ms per comparison: a new client waits only for the current comparison. At first the
// guessers have no failures either.
TEST(ComparisonQueue, DelaysANewClientByOneComparisonDespite100Guessers) {
  ComparisonQueue queue;
  SteadyTime now = kBeginning;
  for (int turn = 0; turn < 500; ++turn) {
    for (int i = 0; i < 100; ++i) queue.add({fmt::format("guesser {}", i), fmt::format("{} {}", turn, i)}, now);
    if (turn % 10 == 5) {
      const std::string client = fmt::format("client {}", turn);
      queue.add({client, "x"}, now + std::chrono::milliseconds(50));
      EXPECT_EQ(address_taken(queue, now + std::chrono::milliseconds(50)), client);
    }
    const auto key = queue.take(now);
    now += std::chrono::milliseconds(100);
    if (key) queue.addresses().failed(key->first, now);
    queue.take_expired(now);
  }
}

TEST(ComparisonQueue, QueuesEightPerAddressForTenSeconds) {
  ComparisonQueue queue;
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(queue.add({"a", std::to_string(i)}, kBeginning));
  EXPECT_FALSE(queue.add({"a", "8"}, kBeginning));
  EXPECT_TRUE(queue.add({"b", "8"}, kBeginning + std::chrono::seconds(1)));
  EXPECT_TRUE(queue.take_expired(kBeginning + std::chrono::seconds(10) - std::chrono::milliseconds(1)).empty());
  EXPECT_EQ(queue.take_expired(kBeginning + std::chrono::seconds(10)).size(), 8U);
  EXPECT_EQ(address_taken(queue, kBeginning + std::chrono::seconds(10)), "b");
  EXPECT_FALSE(queue.next_time(kBeginning));
}

TEST(ClientAddresses, RemoveFailuresAfterTenMinutesAndTheOldestOfMany) {
  ClientAddresses addresses;
  addresses.failed("first", kBeginning);
  EXPECT_EQ(addresses.find("first", kBeginning + ClientAddresses::kRemembered - std::chrono::seconds(1))->failures, 1);
  EXPECT_EQ(addresses.find("first", kBeginning + ClientAddresses::kRemembered)->failures, 0);
  for (std::size_t i = 0; i < ClientAddresses::kMaxAddresses; ++i)
    addresses.seen(std::to_string(i), kBeginning + std::chrono::seconds(1));
  EXPECT_EQ(addresses.size(), ClientAddresses::kMaxAddresses);
  EXPECT_FALSE(addresses.find("first", kBeginning));
  EXPECT_TRUE(addresses.find("0", kBeginning));
}

}  // namespace
}  // namespace prism::prismweb
