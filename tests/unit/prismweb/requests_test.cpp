// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tools/prismweb/api.hpp"
#include "tools/prismweb/methods.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

TEST(ApiTargets, HaveInstanceMethodAndParams) {
  const auto call = parse_api("/api/gyro1/history?seconds=60&axis=z");
  ASSERT_TRUE(call);
  EXPECT_EQ(call->instance, "gyro1");
  EXPECT_EQ(call->method, "history");
  EXPECT_EQ(call->params, json({{"seconds", 60}, {"axis", "z"}}));
  EXPECT_EQ(parse_api("/api/a%20b/bias")->instance, "a b");
  EXPECT_EQ(parse_api("/api/g/bias?axis=1")->params["axis"], "1") << "an axis is a name";
  EXPECT_EQ(parse_api("/api/g/range?from_s=1.5e3")->params["from_s"], 1500);
  EXPECT_EQ(parse_api("/api/g/events?count=nan")->params["count"], "nan") << "not a JSON number";
  EXPECT_EQ(parse_api("/api/instances")->method, "instances");
}

TEST(ApiTargets, InvalidOnesAreRejected) {
  for (const char* target : {"/api/", "/api/gyro1", "/api//bias", "/api/%zz/bias", "/api/%4", "/api/g/bias?=1",
                             "/api/g/bias?a=%4", "/metrics", "/"})
    EXPECT_FALSE(parse_api(target)) << target;
}

TEST(Subscriptions, AreParsedAsByPrismd) {
  const Subscription none;
  EXPECT_EQ(*subscription_from_params(nullptr, true, none), (Subscription{1, true, true, {}}));
  EXPECT_EQ(*subscription_from_params({{"every", 5}}, true, none), (Subscription{5, true, true, {}}));
  EXPECT_EQ(*subscription_from_params({{"streams", {"window"}}, {"axes", {"z", "x"}}}, true, none),
            (Subscription{0, true, false, {"x", "z"}}));
  const Subscription before{2, true, false, {}};
  EXPECT_EQ(*subscription_from_params({{"streams", {"event"}}}, true, before), (Subscription{2, true, true, {}}));
  EXPECT_EQ(*subscription_from_params({{"streams", {"sample"}}}, false, before), (Subscription{0, true, false, {}}));
  EXPECT_EQ(*subscription_from_params(nullptr, false, before), none);
}

TEST(Subscriptions, InvalidOnesAreRejected) {
  for (const char* params : {"[]", "1", R"({"streams":[]})", R"({"streams":"sample"})", R"({"streams":["rows"]})",
                             R"({"every":0})", R"({"every":1.5})", R"({"every":1000001})", R"({"axes":[]})",
                             R"({"axes":[1]})", R"({"axes":"z"})", R"({"every":-1})"})
    EXPECT_FALSE(subscription_from_params(json::parse(params), true, {})) << params;
  EXPECT_TRUE(subscription_from_params({{"axes", std::vector<std::string>(64, "z")}}, true, {}));
  EXPECT_FALSE(subscription_from_params({{"axes", std::vector<std::string>(65, "z")}}, true, {}))
      << "each row is compared with the list";
}

TEST(Errors, AreMembersOfAResponse) {
  const json answer = json::parse("{" + error_member(kNoMethod, "a \"b\"\n<script>") + "}");
  EXPECT_EQ(answer["error"]["code"], -32601);
  EXPECT_EQ(answer["error"]["message"], "a \"b\"\n<script>");
}

}  // namespace
}  // namespace prism::prismweb
