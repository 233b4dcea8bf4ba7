// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/client/client.hpp"

namespace prism::client {
namespace {

using nlohmann::json;

TEST(Response, HasTheCodeOfTheError) {
  const auto busy = response_of("rows", json::parse(R"({"id": 1, "error": {"code": -32004, "message": "later"}})"));
  EXPECT_EQ(busy.error().code, config::kBusy);
  EXPECT_EQ(busy.error().text(), "prismd: later");
  for (const char* text : {R"({"error": {}})", R"({"error": 3})", R"({"error": {"code": "-32004"}})"})
    EXPECT_EQ(response_of("version", json::parse(text)).error().code, config::kFailed) << text;
}

// Version 0.2 returns the members of the only axis in the result itself.
TEST(Response, OfAnOlderPrismdIsAnError) {
  EXPECT_EQ(response_of("bias", json::parse(R"({"result": {"axis": "z"}})")).error().text(),
            "prismd: found a response of protocol 1, expected 2: this prismd is older; restart it");
  EXPECT_TRUE(response_of("bias", json::parse(R"({"result": {"axes": {"z": {}}}})")));
  EXPECT_TRUE(response_of("line", json::parse(R"({"result": {"device": ""}})")));
}

TEST(Response, IsReadByAxis) {
  const json two = json::parse(R"({"axes": {"x": 1, "y": 2}})"), one = json::parse(R"({"axes": {"z": 3}})");
  EXPECT_EQ(of_axis(two, "y"), 2);
  EXPECT_EQ(of_axis(one, ""), 3);
  for (const json& none : {of_axis(two, ""), of_axis(one, "x"), of_axis(json(), ""), of_axis(json(3), "x")})
    EXPECT_TRUE(none.is_null()) << none;
}

TEST(Response, HasTheMembersOfAnAxis) {
  const json both =
      json::parse(R"({"state": 1, "log": {"rows": 5}, "axes": {"x": {"quality": 2, "log": {"a": 3}}, "y": 4}})");
  EXPECT_EQ(with_axis(both, "x"),
            json::parse(R"({"state": 1, "axis": "x", "quality": 2, "log": {"rows": 5, "a": 3}})"));
  EXPECT_EQ(with_axis(both, "y"), json::parse(R"({"state": 1, "axis": "y", "log": {"rows": 5}})"));
  EXPECT_EQ(with_axis(json::parse(R"({"log": 1, "axes": {"x": {"log": {"a": 3}}}})"), "x"),
            json::parse(R"({"axis": "x", "log": {"a": 3}})"));
}

}  // namespace
}  // namespace prism::client
