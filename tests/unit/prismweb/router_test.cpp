// SPDX-License-Identifier: MIT
#include "tools/prismweb/router.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.hpp"

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
  const Answer first = file_answer(folder.file(""), "/page.js");
  EXPECT_EQ(first.status, 200);
  EXPECT_EQ(first.body, "let a;\n");
  EXPECT_EQ(first.media_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(file_answer(folder.file(""), "/page.js").etag, first.etag);
  std::ofstream(path) << "let b, c;\n";
  EXPECT_NE(file_answer(folder.file(""), "/page.js").etag, first.etag);
}

TEST(StaticFiles, DirectoriesAndMissingFilesAreNotFound) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("folder.js"));
  for (const char* const target : {"/folder.js", "/none.js"})
    EXPECT_EQ(file_answer(folder.file(""), target).status, 404) << target;
  EXPECT_EQ(file_answer("", "/index.html").status, 404);
}

}  // namespace
}  // namespace prism::prismweb
