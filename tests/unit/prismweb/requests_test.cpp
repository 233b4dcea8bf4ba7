// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismweb/api.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/methods.hpp"
#include "tools/prismweb/static_files.hpp"

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

TEST(StaticFiles, ATargetIsAFileOfThePage) {
  EXPECT_EQ(file_of_target("/"), "index.html");
  EXPECT_EQ(file_of_target("/page.js"), "page.js");
  EXPECT_EQ(file_of_target("/page.js?x=1"), "page.js");
  EXPECT_EQ(file_of_target("/charts/strip.js"), "charts/strip.js");
}

TEST(StaticFiles, OtherTargetsAreNotServed) {
  for (const char* target :
       {"", "page.js", "//page.js", "/../page.js", "/charts/../../etc/passwd.txt", "/%2e%2e/page.js", "/.hidden.js",
        "/charts/.hidden.js", "/a/b/page.js", "/page.cpp", "/page", "/charts/", "/a\\b.js", "/a b.js", "/./page.js"})
    EXPECT_EQ(file_of_target(target), "") << target;
}

TEST(StaticFiles, HaveATypeAndAnETagThatChangesWithTheFile) {
  const test::TemporaryFolder folder;
  const auto path = folder.file("page.js");
  std::ofstream(path) << "let a;\n";
  const StaticFile first = read_static(folder.file(""), "/page.js");
  EXPECT_EQ(first.status, 200);
  EXPECT_EQ(first.body, "let a;\n");
  EXPECT_EQ(first.media_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(read_static(folder.file(""), "/page.js").etag, first.etag);
  std::ofstream(path) << "let b, c;\n";
  EXPECT_NE(read_static(folder.file(""), "/page.js").etag, first.etag);
}

TEST(StaticFiles, DirectoriesAndMissingFilesAreNotFound) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("folder.js"));
  EXPECT_EQ(read_static(folder.file(""), "/folder.js").status, 404);
  EXPECT_EQ(read_static(folder.file(""), "/none.js").status, 404);
  EXPECT_EQ(read_static("", "/index.html").status, 404);
}

// Copying and writing a value are recursive: each level needs stack.
TEST(Messages, AreLimitedTo32Levels) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse_message(nested(32)).is_array());
  EXPECT_TRUE(parse_message(nested(33)).is_null());
  EXPECT_TRUE(parse_message(nested(30000)).is_null());
  EXPECT_TRUE(parse_message("[").is_null());
  EXPECT_EQ(parse_message(R"({"token":"a"})").dump(), R"({"token":"a"})");
}

TEST(JsonTexts, AreValidUtf8) { EXPECT_EQ(json_text({{"a", "\xff"}}), "{\"a\":\"\xef\xbf\xbd\"}"); }

}  // namespace
}  // namespace prism::prismweb
