// SPDX-License-Identifier: MIT
#include "tools/prismweb/gyro_proxy.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

namespace prism::prismweb {
namespace {

using nlohmann::json;

std::string line(const std::string& method, const std::string& axis, int number) {
  return R"({"jsonrpc":"2.0","method":")" + method + R"(","params":{"axis":")" + axis + R"(","time_s":)" +
         std::to_string(number) + "}}";
}

std::string times(const Batch& batch) {
  std::string text;
  for (const json& one : json::parse("[" + batch.lines + "]"))
    text += one["method"].get<std::string>() + " " + one["params"].value("axis", "") +
            std::to_string(one["params"].value("time_s", 0)) + " ";
  return text;
}

TEST(Notifications, AreRecognisedByTheirStart) {
  const std::string text = line("sample", "z", 1);
  EXPECT_EQ(notification_of(text).method, "sample");
  EXPECT_EQ(notification_of(text).axis, "z");
  EXPECT_EQ(notification_of(R"({"jsonrpc":"2.0","method":"event","params":{"time_s":1}})").axis, "");
  EXPECT_EQ(notification_of(R"({"jsonrpc":"2.0","id":1,"result":{}})").method, "");
  EXPECT_EQ(notification_of("").method, "");
}

// prismd sends every n-th sample, n the greatest common divisor; each client gets its own share, counted per axis.
TEST(Batches, HaveEveryNthSampleOfEachAxis) {
  Batch fourth, sixth;
  fourth.subscription = {4, false, false, {}};
  sixth.subscription = {6, false, false, {"x"}};
  for (int i = 0; i < 6; ++i) {
    for (const char* const axis : {"x", "y"}) {
      const std::string text = line("sample", axis, i);
      fourth.put(notification_of(text), 2);
      sixth.put(notification_of(text), 2);
    }
  }
  EXPECT_EQ(times(fourth), "sample x1 sample y1 sample x3 sample y3 sample x5 sample y5 ");
  EXPECT_EQ(times(sixth), "sample x2 sample x5 ");
  EXPECT_EQ(sixth.rows, 2U);
}

TEST(Batches, HaveWhatTheClientSubscribedTo) {
  const std::vector<std::string> lines = {line("sample", "z", 1), line("window", "z", 2), line("window", "y", 3),
                                          R"({"jsonrpc":"2.0","method":"event","params":{"time_s":4}})",
                                          R"({"jsonrpc":"2.0","method":"lost","params":{"rows":5,"rows_total":5}})"};
  for (const auto& [subscription, expected] :
       {std::pair(Subscription{1, true, true, {}}, "sample z1 window z2 window y3 event 4 lost 0 "),
        std::pair(Subscription{0, true, false, {"z"}}, "window z2 lost 0 "),
        std::pair(Subscription{0, false, true, {"z"}}, "event 4 lost 0 ")}) {
    Batch batch;
    batch.subscription = subscription;
    for (const std::string& text : lines) batch.put(notification_of(text), 1);
    EXPECT_EQ(times(batch), expected);
  }
}

TEST(Subscriptions, AreParsedAsByPrismd) {
  const Subscription none;
  EXPECT_EQ(*subscription_of(nullptr, true, none), (Subscription{1, true, true, {}}));
  EXPECT_EQ(*subscription_of({{"every", 5}}, true, none), (Subscription{5, true, true, {}}));
  EXPECT_EQ(*subscription_of({{"streams", {"window"}}, {"axes", {"z", "x"}}}, true, none),
            (Subscription{0, true, false, {"x", "z"}}));
  const Subscription before{2, true, false, {}};
  EXPECT_EQ(*subscription_of({{"streams", {"event"}}}, true, before), (Subscription{2, true, true, {}}));
  EXPECT_EQ(*subscription_of({{"streams", {"sample"}}}, false, before), (Subscription{0, true, false, {}}));
  EXPECT_EQ(*subscription_of(nullptr, false, before), none);
}

TEST(Subscriptions, InvalidOnesAreRejected) {
  for (const char* params : {"[]", "1", R"({"streams":[]})", R"({"streams":"sample"})", R"({"streams":["rows"]})",
                             R"({"every":0})", R"({"every":1.5})", R"({"every":1000001})", R"({"axes":[]})",
                             R"({"axes":[1]})", R"({"axes":"z"})", R"({"every":-1})", R"({"stream":["sample"]})"})
    EXPECT_FALSE(subscription_of(json::parse(params), true, {})) << params;
  EXPECT_TRUE(subscription_of({{"axes", std::vector<std::string>(64, "z")}}, true, {}));
  EXPECT_FALSE(subscription_of({{"axes", std::vector<std::string>(65, "z")}}, true, {}))
      << "each row is compared with the list";
}

TEST(Paths, StayInTheirDirectoryForAnyName) {
  EXPECT_EQ(path_part("gyro-1.z"), "gyro-1.z");
  EXPECT_EQ(path_part(".."), "%2E.");
  EXPECT_EQ(path_part("a/b"), "a%2Fb");
}

}  // namespace
}  // namespace prism::prismweb
