// SPDX-License-Identifier: MIT
// Whole files: the old one or the new one, never a part, and nothing left beside it.
#include "base/text_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/support/full_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism {
namespace {

namespace fs = std::filesystem;

class TextFile : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.file(name); }
  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path("")), fs::directory_iterator()); }
  mode_t mode(const std::string& name) const {
    struct stat status {};
    EXPECT_EQ(::stat(path(name).c_str(), &status), 0);
    return status.st_mode & 07777;
  }

  test::TemporaryFolder folder_;
};

TEST_F(TextFile, WhatIsWrittenIsRead) {
  const std::string text("a\0b\r\n\xff", 6);
  ASSERT_TRUE(write_text_file(path("a"), text));
  EXPECT_EQ(*read_text_file(path("a")), text);
  ASSERT_TRUE(write_text_file(path("a"), ""));
  EXPECT_EQ(*read_text_file(path("a")), "");
  EXPECT_EQ(entries(), 1) << "nothing is left beside it";
}

TEST_F(TextFile, ADiskThatFillsUpLeavesTheOldFileWhole) {
  const std::string old(1000, 'o');
  ASSERT_TRUE(write_text_file(path("a"), old));
  {
    const test::FullDisk disk(5000);
    const auto done = write_text_file(path("a"), std::string(10'000, 'n'));
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().text(), path("a") + ": cannot be written: File too large");
  }
  EXPECT_EQ(*read_text_file(path("a")), old);
  EXPECT_EQ(entries(), 1) << "nothing is left beside it";
}

TEST_F(TextFile, AnExistingFileKeepsItsModeAndALinkItsPlace) {
  ASSERT_TRUE(write_text_file(path("a"), "old"));
  ASSERT_EQ(::chmod(path("a").c_str(), 0640), 0);
  fs::create_symlink("a", path("link"));
  ASSERT_TRUE(write_text_file(path("link"), "new"));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(*read_text_file(path("a")), "new");
  EXPECT_EQ(mode("a"), 0640u);
}

// As root a rename would put a file in the place of /dev/null.
TEST_F(TextFile, WhatIsNoFileIsWrittenStraight) {
  ASSERT_TRUE(write_text_file("/dev/null", "gone"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(write_text_file("/dev/full", "x").error().text(), "/dev/full: cannot be written: No space left on device");
}

TEST_F(TextFile, SaysWhyItRefuses) {
  EXPECT_EQ(read_text_file(path("")).error().what, "is a folder, expected a file");
  EXPECT_EQ(write_text_file(path(""), "x").error().what, "is a folder, expected a file");
  EXPECT_EQ(read_text_file(path("none")).error().what, "cannot be read: No such file or directory");
  EXPECT_EQ(write_text_file(path("none/a"), "x").error().what, "cannot be written: No such file or directory");
}

}  // namespace
}  // namespace prism
