// SPDX-License-Identifier: MIT
// A client: unread rows are queued, then dropped, counted and reported; it never delays other clients.
#include "daemon/socket/client.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <sstream>

#include "tests/support/daemon_parts.hpp"

namespace prism::socket {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Lines of 100 characters, each with its number.
void send_row(test::Asker& peer, int number) {
  std::string text = "row " + std::to_string(number) + " ";
  text.resize(99, '.');
  peer.client()->send(std::make_shared<const std::string>(text + "\n"), 1);
}

// Fills the kernel's buffer and the queue: later rows are dropped.
int send_until_rows_are_lost(test::Asker& peer) {
  int number = 0;
  while (peer.client()->lost_rows() == 0 && number < 100'000) send_row(peer, number++);
  return number;
}

TEST(Client, SendsAtOnceWhatTheSocketTakes) {
  test::Asker peer(10'000);
  send_row(peer, 1);
  peer.client()->answer("answer\n");
  EXPECT_THAT(peer.read(), AllOf(StartsWith("row 1 "), EndsWith("answer\n")));
}

TEST(Client, WhatTheSocketDoesNotTakeIsSentInOrderLater) {
  test::Asker peer(10'000);
  const int sent = send_until_rows_are_lost(peer) - 1;
  const auto lines = lines_of(peer.read());
  ASSERT_GT(lines.size(), static_cast<std::size_t>(sent));
  for (int i = 0; i < sent; ++i) {
    ASSERT_EQ(lines[static_cast<std::size_t>(i)].size(), 99u);
    ASSERT_THAT(lines[static_cast<std::size_t>(i)], StartsWith("row " + std::to_string(i) + " "));
  }
}

TEST(Client, LosesOneHoleAndIsToldHowManyRowsItHeld) {
  test::Asker peer(10'000);
  send_until_rows_are_lost(peer);
  for (int i = 0; i < 9; ++i) send_row(peer, -1);
  EXPECT_EQ(peer.client()->lost_rows(), 10u);
  const auto lines = lines_of(peer.read());
  EXPECT_EQ(lines.back(), R"({"jsonrpc":"2.0","method":"lost","params":{"rows":10,"rows_total":10}})");
  send_row(peer, 7);
  EXPECT_THAT(peer.read(), StartsWith("row 7 ")) << "rows come again";
  EXPECT_EQ(peer.client()->lost_rows(), 10u);
}

TEST(Client, AnswersAreNeverDropped) {
  test::Asker peer(10'000);
  send_until_rows_are_lost(peer);
  peer.client()->answer("the answer\n");
  EXPECT_THAT(peer.read(), HasSubstr("the answer\n"));
}

TEST(Client, WhoAsksWithoutReadingIsClosed) {
  test::Asker peer(1000);
  const std::string answer = std::string(999, 'a') + "\n";
  int answers = 0;
  while (peer.client()->open() && answers < 10'000) {
    peer.client()->answer(answer);
    ++answers;
  }
  EXPECT_FALSE(peer.client()->open());
  EXPECT_LT(answers, 10'000);
  peer.client()->answer(answer);  // to a closed one: nothing
  send_row(peer, 1);
}

TEST(Client, APeerThatIsGoneClosesIt) {
  test::Asker peer(10'000);
  peer.hang_up();
  send_row(peer, 1);
  EXPECT_FALSE(peer.client()->open());
}

TEST(Client, APeerThatGoesWhileTextWaitsClosesIt) {
  test::Asker peer(10'000);
  send_until_rows_are_lost(peer);
  peer.hang_up();
  peer.io().poll();
  EXPECT_FALSE(peer.client()->open());
}

TEST(Client, MayBeClosedWhileTextWaits) {
  test::Asker peer(10'000);
  send_until_rows_are_lost(peer);
  peer.client()->close();
  peer.io().poll();
  EXPECT_FALSE(peer.client()->open());
}

// Earlier bug: 250 clients with unread responses used 324 to 555 MB.
TEST(Client, AllTogetherHoldSoMuchAndTheOneThatHoldsMostGives) {
  const auto memory = std::make_shared<ClientMemory>(5'000'000);
  std::vector<std::unique_ptr<test::Asker>> peers;
  for (int i = 0; i < 8; ++i) peers.push_back(std::make_unique<test::Asker>(1 << 20, memory));
  const std::string answer = std::string(99'999, 'a') + "\n";
  for (int i = 0; i < 8; ++i) peers[1]->client()->answer(answer);
  EXPECT_TRUE(peers[1]->client()->open());
  for (int round = 0; round < 30; ++round) {
    for (const std::size_t i : {0u, 2u, 3u}) peers[i]->client()->answer(answer);
    EXPECT_LE(memory->used_bytes(), 5'000'000u);
  }
  EXPECT_TRUE(peers[1]->client()->open()) << "what it holds is little";
  EXPECT_FALSE(peers[0]->client()->open() && peers[2]->client()->open() && peers[3]->client()->open());
  peers[4]->client()->answer("small\n");
  EXPECT_EQ(peers[4]->read(), "small\n") << "others are answered";
  peers.clear();
  EXPECT_EQ(memory->used_bytes(), 0u);
}

TEST(Client, KnowsThatItsPeerIsGoneThoughItSentMuchBefore) {
  test::Asker peer;
  EXPECT_FALSE(peer.client()->gone());
  peer.hang_up();
  EXPECT_TRUE(peer.client()->gone());
}

TEST(Client, IsIdleWhereItNeitherAsksNorListens) {
  test::Asker peer;
  EXPECT_LT(peer.client()->idle(), std::chrono::seconds(1));
  peer.client()->subscription.events = true;
  EXPECT_EQ(peer.client()->idle(), Client::Clock::duration::zero());
  EXPECT_EQ(peer.client()->user(), ::geteuid());
}

TEST(Client, TheDaemonsOwnUserMayChangeThings) {
  test::Asker peer(10'000);
  EXPECT_TRUE(peer.client()->privileged());
  peer.client()->close();
  EXPECT_FALSE(peer.client()->privileged()) << "whoever cannot be named";
}

}  // namespace
}  // namespace prism::socket
