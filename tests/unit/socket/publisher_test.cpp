// SPDX-License-Identifier: MIT
// The publisher: each client gets its subscription, in order, independent of other clients.
#include "daemon/socket/publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <list>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/daemon_parts.hpp"

namespace prism::socket {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

compensation::Compensated sample_at(std::int64_t second) {
  compensation::Compensated row;
  row.sample.time_ns = second * 1'000'000'000;
  row.sample.rate_deg_per_h = 1.5;
  return row;
}

Event event_of(const char* kind) {
  Event event;
  event.kind = kind;
  event.json = "{}";
  return event;
}

pipeline::Rows rows_of(std::vector<std::string> axes) {
  pipeline::Rows rows;
  rows.axes = std::make_shared<const std::vector<std::string>>(std::move(axes));
  return rows;
}

struct PublisherTest : testing::Test {
  test::Asker& subscriber(const Subscription& subscription) {
    test::Asker& peer = peers.emplace_back(10'000);
    peer.client()->subscription = subscription;
    publisher.add(peer.client());
    publisher.update();
    return peer;
  }
  // Received messages: "sample 3" (its time), "window", "event".
  static std::vector<std::string> heard(test::Asker& peer, bool axes = false) {
    std::istringstream in(peer.read());
    std::vector<std::string> messages;
    for (std::string line; std::getline(in, line);) {
      const auto told = nlohmann::json::parse(line);
      std::string message = told["method"];
      if (message == "sample") message += " " + std::to_string(told["params"]["time_s"].get<int>());
      if (axes) message.insert(0, told["params"]["axis"].get<std::string>() + " ");
      messages.push_back(message);
    }
    return messages;
  }
  // One call of the pipeline: samples of these seconds, and behind them a window.
  void publish(std::int64_t first, std::int64_t last, bool window = false) {
    pipeline::Rows rows = rows_of({"z"});
    for (std::int64_t second = first; second <= last; ++second) rows.samples.push_back({0, sample_at(second)});
    if (window) rows.windows.push_back({0, rows.samples.size(), 0, {}});
    publisher.rows(rows);
  }

  std::list<test::Asker> peers;
  Publisher publisher;
};

TEST_F(PublisherTest, EachHearsWhatItSubscribed) {
  auto& all = subscriber({1, true, true});
  auto& third = subscriber({3, false, false});
  auto& windows = subscriber({0, true, false});
  auto& events = subscriber({0, false, true});
  auto& nothing = subscriber({});
  publish(1, 6, true);
  publisher.event(event_of("note"));
  EXPECT_THAT(heard(all),
              ElementsAre("sample 1", "sample 2", "sample 3", "sample 4", "sample 5", "sample 6", "window", "event"));
  EXPECT_THAT(heard(third), ElementsAre("sample 1", "sample 4"));
  EXPECT_THAT(heard(windows), ElementsAre("window"));
  EXPECT_THAT(heard(events), ElementsAre("event"));
  EXPECT_THAT(heard(nothing), IsEmpty());
}

// A second comes before the sample that closes it: clients see the pipeline's order.
TEST_F(PublisherTest, AWindowComesBetweenTheSamplesBeforeAndBehindIt) {
  auto& peer = subscriber({1, true, false});
  pipeline::Rows rows = rows_of({"z"});
  for (const std::int64_t second : {1, 2, 3}) rows.samples.push_back({0, sample_at(second)});
  rows.windows.push_back({0, 2, 0, {}});
  publisher.rows(rows);
  EXPECT_THAT(heard(peer), ElementsAre("sample 1", "sample 2", "window", "sample 3"));
}

// Samples wait for no disk; windows do, and the events behind them, in their order.
TEST_F(PublisherTest, AHeldWindowGoesOutWhenItIsReleasedOrWithTheNextThatNeedNotWait) {
  auto& peer = subscriber({1, true, true});
  pipeline::Rows rows = rows_of({"z"});
  rows.samples.push_back({0, sample_at(1)});
  rows.windows.push_back({0, 1, 0, {}});
  publisher.rows(rows, true);
  publisher.event(event_of("quality"));
  EXPECT_THAT(heard(peer), ElementsAre("sample 1"));
  publisher.event(event_of("line_lost"));
  EXPECT_THAT(heard(peer), ElementsAre("event")) << "not about a row: it does not wait for the disk";
  publisher.release();
  EXPECT_THAT(heard(peer), ElementsAre("window", "event"));
  publisher.event(event_of("quality"));
  EXPECT_THAT(heard(peer), ElementsAre("event"));
  publisher.rows(rows, true);
  publisher.rows(rows);
  EXPECT_THAT(heard(peer), ElementsAre("sample 1", "sample 1", "window", "window"));
}

// Of a frame of three axes: its windows in one line each but one send, then its samples.
TEST_F(PublisherTest, EachHearsTheAxesItChose) {
  auto& all = subscriber({2, true, true});
  auto& y = subscriber({1, true, false, 0b010});
  auto& xz = subscriber({0, true, false, 0b101});
  pipeline::Rows rows = rows_of({"x", "y", "z"});
  for (const std::int64_t second : {1, 2}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (second == 2) rows.windows.push_back({axis, 3, 0, {}});
      rows.samples.push_back({axis, sample_at(second)});
    }
  }
  publisher.rows(rows);
  EXPECT_THAT(heard(all, true),
              ElementsAre("x sample 1", "y sample 1", "z sample 1", "x window", "y window", "z window"));
  EXPECT_THAT(heard(y, true), ElementsAre("y sample 1", "y window", "y sample 2"));
  EXPECT_THAT(heard(xz, true), ElementsAre("x window", "z window"));
}

TEST_F(PublisherTest, ASubscriptionOfOthersDoesNotDisturbTheCount) {
  auto& third = subscriber({3, false, false});
  publish(1, 2);
  auto& late = subscriber({3, false, false});
  publish(3, 4);
  EXPECT_THAT(heard(third), ElementsAre("sample 1", "sample 4"));
  EXPECT_THAT(heard(late), ElementsAre("sample 4"));
}

TEST_F(PublisherTest, AnEndedSubscriptionEndsAtOnce) {
  auto& peer = subscriber({2, true, false});
  publish(1, 2, true);
  peer.client()->subscription = {};
  publisher.update();
  publish(3, 9, true);
  EXPECT_THAT(heard(peer), ElementsAre("sample 1", "window"));
}

TEST_F(PublisherTest, WhatTheGoneLostStaysInTheSum) {
  auto& deaf = subscriber({1, false, false});
  auto& other = subscriber({1, false, false});
  for (std::int64_t second = 1; deaf.client()->lost_rows() == 0 && second < 100'000; ++second) {
    publish(second, second);
    other.read();
  }
  const std::uint64_t lost = publisher.lost_rows();
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(other.client()->lost_rows(), 0u);
  publisher.remove(deaf.client().get());
  publisher.remove(deaf.client().get());
  EXPECT_EQ(publisher.clients(), 1u);
  EXPECT_EQ(publisher.lost_rows(), lost);
}

}  // namespace
}  // namespace prism::socket
