// SPDX-License-Identifier: MIT
#include "tools/prismweb/subscription_table.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "tools/prismweb/connection.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

std::string line(const std::string& method, const std::string& axis, int number) {
  return R"({"jsonrpc":"2.0","method":")" + method + R"(","params":{"axis":")" + axis + R"(","time_s":)" +
         std::to_string(number) + "}}";
}

struct Recorder : Subscriber {
  std::vector<Text> texts;
  std::vector<std::string> got;  // method axis number

  void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override {
    texts.push_back(text);
    const json batch = json::parse(*text);
    EXPECT_EQ(batch["instance"], instance);
    EXPECT_EQ(batch["batch"].size(), rows);
    for (const json& one : batch["batch"])
      got.push_back(one["method"].get<std::string>() + " " + one["params"].value("axis", "") + " " +
                    std::to_string(one["params"].value("time_s", 0)));
  }
};

void put(SubscriptionTable& subscriptions, const std::string& text) { subscriptions.put(notification_of(text)); }

TEST(Notifications, AreRecognisedByTheirStart) {
  const std::string text = line("sample", "z", 1);
  EXPECT_EQ(notification_of(text).method, "sample");
  EXPECT_EQ(notification_of(text).axis, "z");
  EXPECT_EQ(notification_of(R"({"jsonrpc":"2.0","method":"event","params":{"time_s":1}})").axis, "");
  EXPECT_EQ(notification_of(R"({"jsonrpc":"2.0","id":1,"result":{}})").method, "");
  EXPECT_EQ(notification_of("").method, "");
}

TEST(SubscriptionTable, SharesOneTextBetweenEqualSubscriptions) {
  SubscriptionTable subscriptions("g");
  Recorder one, other, windows;
  subscriptions.set(&one, {1, true, true, {}});
  subscriptions.set(&other, {1, true, true, {}});
  subscriptions.set(&windows, {0, true, false, {}});
  for (int i = 0; i < 3; ++i) put(subscriptions, line("sample", "z", i));
  put(subscriptions, line("window", "z", 3));
  subscriptions.flush();
  EXPECT_EQ(one.got, (std::vector<std::string>{"sample z 0", "sample z 1", "sample z 2", "window z 3"}));
  EXPECT_EQ(one.texts, other.texts) << "the same object";
  EXPECT_EQ(windows.got, std::vector<std::string>{"window z 3"});
  EXPECT_FALSE(subscriptions.pending());
  subscriptions.flush();
  EXPECT_EQ(one.texts.size(), 1U) << "no empty batch";
}

// A client adds a curve during a batch.
TEST(SubscriptionTable, AChangedSubscriptionLosesAndRepeatsNoRows) {
  SubscriptionTable subscriptions("g");
  Recorder grows, other;
  subscriptions.set(&grows, {0, true, false, {}});
  subscriptions.set(&other, {1, true, false, {}});
  put(subscriptions, line("window", "z", 1));
  subscriptions.set(&grows, {1, true, false, {}});
  put(subscriptions, line("sample", "z", 2));
  subscriptions.set(&grows, {1, true, false, {}});
  subscriptions.flush();
  EXPECT_EQ(grows.got, (std::vector<std::string>{"window z 1", "sample z 2"}));
  EXPECT_EQ(other.got, (std::vector<std::string>{"window z 1", "sample z 2"}));
  EXPECT_EQ(grows.texts.size(), 2U);
  put(subscriptions, line("sample", "z", 3));
  subscriptions.flush();
  EXPECT_EQ(grows.texts[2], other.texts[1]) << "the same object again";
}

// prismd sends every n-th sample, n the greatest common divisor; each client gets its own share, counted per axis.
TEST(SubscriptionTable, SendsEveryNthSampleOfEachAxis) {
  SubscriptionTable subscriptions("g");
  Recorder fourth, sixth;
  subscriptions.set(&fourth, {4, false, false, {}});
  subscriptions.set(&sixth, {6, false, false, {"x"}});
  EXPECT_EQ(subscriptions.sample_every(), 2U);
  for (int i = 0; i < 6; ++i) {
    put(subscriptions, line("sample", "x", i));
    put(subscriptions, line("sample", "y", i));
  }
  subscriptions.flush();
  EXPECT_EQ(fourth.got, (std::vector<std::string>{"sample x 1", "sample y 1", "sample x 3", "sample y 3", "sample x 5",
                                                  "sample y 5"}));
  EXPECT_EQ(sixth.got, (std::vector<std::string>{"sample x 2", "sample x 5"}));
}

TEST(SubscriptionTable, SendsLostToAllSubscribers) {
  SubscriptionTable subscriptions("g");
  Recorder client;
  subscriptions.set(&client, {0, false, true, {"z"}});
  put(subscriptions, R"({"jsonrpc":"2.0","method":"lost","params":{"rows":5,"rows_total":5}})");
  put(subscriptions, line("window", "z", 1));
  subscriptions.flush();
  EXPECT_EQ(client.got, std::vector<std::string>{"lost  0"});
}

TEST(SubscriptionTable, UnsubscribingDuringAFlushStopsTheDelivery) {
  struct Leaver : Recorder {
    SubscriptionTable* subscriptions = nullptr;
    Subscriber* other = nullptr;
    void deliver(const std::string& instance, const Text& text, std::uint64_t rows) override {
      Recorder::deliver(instance, text, rows);
      subscriptions->set(other, {});
    }
  };
  SubscriptionTable subscriptions("g");
  Leaver first;
  Recorder second;
  first.subscriptions = &subscriptions;
  first.other = &second;
  subscriptions.set(&first, {0, true, false, {}});
  subscriptions.set(&second, {0, true, false, {}});
  put(subscriptions, line("window", "z", 1));
  subscriptions.flush();
  EXPECT_EQ(first.got.size(), 1U);
  EXPECT_TRUE(second.got.empty());
  EXPECT_FALSE(subscriptions.subscription_of(&second).any());
}

struct Connections {
  std::shared_ptr<ConnectionList> list = std::make_shared<ConnectionList>();
  std::vector<std::shared_ptr<Connection>> all;
  std::vector<std::unique_ptr<ConnectionList::Entry>> entries;

  Connection& add() {
    all.push_back(std::make_shared<Connection>());
    all.back()->fd = -1;
    entries.push_back(std::make_unique<ConnectionList::Entry>(list, all.back()));
    return *all.back();
  }
  /// Index of the closed connection; -1 if none.
  int ended() const {
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i]->is_ending) return static_cast<int>(i);
    }
    return -1;
  }
};

TEST(ConnectionList, ClosesNoneBelowTheLimit) {
  Connections connections;
  for (int i = 0; i < 127; ++i) connections.add();
  EXPECT_TRUE(connections.list->make_room());
  EXPECT_EQ(connections.ended(), -1);
}

TEST(ConnectionList, ClosesTheOldestOfAnUnknownClient) {
  Connections connections;
  for (int i = 0; i < 128; ++i) connections.add();
  connections.all[0]->is_known = connections.all[1]->is_known = true;
  EXPECT_TRUE(connections.list->make_room());
  EXPECT_EQ(connections.ended(), 2);
}

TEST(ConnectionList, ClosesNoKnownClient) {
  Connections connections;
  for (int i = 0; i < 128; ++i) connections.add().is_known = true;
  EXPECT_FALSE(connections.list->make_room());
}

}  // namespace
}  // namespace prism::prismweb
