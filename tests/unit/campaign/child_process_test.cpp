// SPDX-License-Identifier: MIT
// Child processes: arguments, output files and failures.
#include "tools/prismcal/campaign/child_process.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include "base/file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::campaign {
namespace {

using testing::HasSubstr;

TEST(ChildProcess, PassesArgumentsUnchanged) {
  const test::TemporaryFolder folder;
  const std::string errors = folder.file("errors");
  EXPECT_EQ(output_of({"printf", "%s|", "a b", "$(id)", "'\"*;", ""}, errors).value(), "a b|$(id)|'\"*;||");
}

TEST(ChildProcess, ReportsAFailureAndKeepsItsMessage) {
  const test::TemporaryFolder folder;
  const std::string errors = folder.file("errors");
  EXPECT_THAT(output_of({"ls", "/no/such/file"}, errors).error().text(), HasSubstr(errors));
  EXPECT_THAT(read_text_file(errors).value(), HasSubstr("/no/such/file"));
  EXPECT_THAT(output_of({"no-such-program"}, errors).error().text(), HasSubstr("No such file"));
}

TEST(ChildProcess, AppendsTheOutputToAFile) {
  const test::TemporaryFolder folder;
  for (const char* word : {"one", "two"})
    ::waitpid(start_program({"echo", word}, folder.file("out")).value(), nullptr, 0);
  EXPECT_EQ(read_text_file(folder.file("out")).value(), "one\ntwo\n");
}

}  // namespace
}  // namespace prism::campaign
