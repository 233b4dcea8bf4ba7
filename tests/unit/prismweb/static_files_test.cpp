// SPDX-License-Identifier: MIT
#include "tools/prismweb/static_files.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace prism::prismweb {
namespace {

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

}  // namespace
}  // namespace prism::prismweb
