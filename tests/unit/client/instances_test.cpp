// SPDX-License-Identifier: MIT
#include "tools/client/instances.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/outside_text.hpp"
#include "config/socket_path.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::client {
namespace {

TEST(Instances, AreNamesSocketsAndDirectories) {
  const test::TemporaryFolder folder;
  for (const char* name : {"a.sock", "b.sock", "c.txt"}) std::ofstream(folder.file(name)) << "";
  EXPECT_EQ(list_instances({"no-such-gyro", "/x/a.sock", folder.file("")}),
            (std::vector<InstanceSocket>{{"no-such-gyro", config::default_socket("no-such-gyro")},
                                         {"a", "/x/a.sock"},
                                         {"a", folder.file("a.sock")},
                                         {"b", folder.file("b.sock")}}));
  EXPECT_TRUE(list_instances({"/nowhere/at/all/"}).empty());
}

// prismctl, prismrelay and prismweb find an instance of the user, by name and without one.
TEST(Instances, AreFoundInThePlaceOfTheUser) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("prismd"));
  const std::string path = folder.file("prismd/test-of-the-user.sock");
  std::ofstream(path) << "";
  const char* const before = std::getenv("XDG_RUNTIME_DIR");
  const std::string kept = before != nullptr ? before : "";
  ::setenv("XDG_RUNTIME_DIR", folder.file("").c_str(), 1);
  const std::vector<InstanceSocket> named = list_instances({"test-of-the-user"}), all = list_instances({});
  before != nullptr ? ::setenv("XDG_RUNTIME_DIR", kept.c_str(), 1) : ::unsetenv("XDG_RUNTIME_DIR");
  ASSERT_EQ(named.size(), 1u);
  EXPECT_TRUE(std::filesystem::equivalent(named[0].path, path)) << named[0].path;
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back(), named[0]);
}

// Regression: a file name that is not UTF-8 ended the relay, because it could not be written as JSON.
TEST(Instances, InvalidNamesAreListedApart) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> names = {"\xff.sock", "a\nb.sock", "\033[2J.sock", std::string(91, 'n') + ".sock",
                                          "\xe2\x80\xae.sock"};
  for (const std::string& name : names) std::ofstream(folder.file(name)) << "";
  std::ofstream(folder.file("good.sock")) << "";
  std::vector<std::string> invalid;
  EXPECT_EQ(list_instances({folder.file(""), "/x/\xfe.sock"}, &invalid),
            (std::vector<InstanceSocket>{{"good", folder.file("good.sock")}}));
  EXPECT_EQ(invalid.size(), names.size() + 1);
  for (const std::string& name : invalid) EXPECT_TRUE(is_printable(name)) << name;
}

}  // namespace
}  // namespace prism::client
