// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tools/prismweb/api.hpp"
#include "tools/prismweb/methods.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

TEST(ApiTargets, HaveInstanceMethodAndQuery) {
  const auto call = parse_api("/api/gyro1/history?seconds=60&axis=z");
  ASSERT_TRUE(call);
  EXPECT_EQ(call->instance, "gyro1");
  EXPECT_EQ(call->method, "history");
  EXPECT_EQ(call->query, "seconds=60&axis=z");
  EXPECT_EQ(parse_api("/api/a%20b/bias")->instance, "a b");
  EXPECT_EQ(parse_api("/api/instances?a=1")->method, "instances");
  EXPECT_EQ(parse_api("/api/instances?a=1")->query, "a=1");
}

TEST(ApiTargets, InvalidOnesAreRejected) {
  for (const char* target : {"/api/", "/api/gyro1", "/api//bias", "/api/%zz/bias", "/api/%4", "/metrics", "/"})
    EXPECT_FALSE(parse_api(target)) << target;
}

TEST(ApiQueries, AreParams) {
  EXPECT_EQ(*parse_query("seconds=60&axis=z"), json({{"seconds", 60}, {"axis", "z"}}));
  EXPECT_EQ(*parse_query(""), json::object());
  EXPECT_EQ(*parse_query("axis=1"), json({{"axis", "1"}})) << "an axis is a name";
  EXPECT_EQ((*parse_query("from_s=1.5e3"))["from_s"], 1500);
  EXPECT_EQ((*parse_query("count=nan"))["count"], "nan") << "not a JSON number";
}

TEST(ApiQueries, InvalidAndRepeatedParamsAreRejected) {
  for (const char* query : {"=1", "a=%4", "a=1&a=1", "axis=z&seconds=1&axis=y", "a=1&%61=2"})
    EXPECT_FALSE(parse_query(query)) << query;
  EXPECT_EQ(parse_query("a=1&%61=2").error().text(), "query: found the parameter \"a\" twice, expected it once");
}

// A typing error in a name returned the default range.
TEST(Params, UnknownOnesAreNamedWithTheAllowedOnes) {
  constexpr std::array<std::string_view, 2> kAllowed = {"axis", "from_s"};
  EXPECT_EQ(unknown_param("range", {{"axis", "z"}, {"from_s", 1}}, kAllowed), "");
  EXPECT_EQ(unknown_param("range", nullptr, kAllowed), "");
  EXPECT_EQ(unknown_param("range", {{"first_s", 1}}, kAllowed),
            "range: found the parameter \"first_s\", expected only axis, from_s");
  EXPECT_EQ(unknown_param("status", {{"axis", "z"}}, {}), "status: found the parameter \"axis\", expected none");
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
                             R"({"axes":[1]})", R"({"axes":"z"})", R"({"every":-1})", R"({"stream":["sample"]})"})
    EXPECT_FALSE(subscription_from_params(json::parse(params), true, {})) << params;
  EXPECT_TRUE(subscription_from_params({{"axes", std::vector<std::string>(64, "z")}}, true, {}));
  EXPECT_FALSE(subscription_from_params({{"axes", std::vector<std::string>(65, "z")}}, true, {}))
      << "each row is compared with the list";
}

TEST(Errors, AreMembersOfAResponse) {
  const json answer = json::parse("{" + error_member(kUnknownMethod, "a \"b\"\n<script>") + "}");
  EXPECT_EQ(answer["error"]["code"], -32601);
  EXPECT_EQ(answer["error"]["message"], "a \"b\"\n<script>");
}

}  // namespace
}  // namespace prism::prismweb
