// SPDX-License-Identifier: MIT
// The index of segments: numbers increase, also over power cuts, emptied directories and clocks set back.
#include "daemon/pipeline/segment_index.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/disk_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using testing::HasSubstr;

using pipeline::SegmentIndex;

struct SegmentIndexTest : testing::Test {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("gyro.csv.index");

  SegmentIndex opened(const std::vector<std::string>& files = {}) const {
    SegmentIndex index(path);
    index.refresh(files);
    return index;
  }
};

TEST_F(SegmentIndexTest, NumbersGoInTheOrderOfMakingAndStayOverARestart) {
  SegmentIndex index = opened();
  index.made("b.csv");
  index.made("a.csv");
  index.ended("b.csv", 7);
  const SegmentIndex again = opened();
  EXPECT_EQ(again.number("b.csv"), 1u);
  EXPECT_EQ(again.number("a.csv"), 2u);
  EXPECT_EQ(again.number("c.csv"), 0u);
  EXPECT_EQ(again.rows("b.csv"), 7u);
  EXPECT_EQ(again.rows("a.csv"), 0u);
  EXPECT_EQ(again.id(), index.id());
  EXPECT_EQ(index.id().size(), 32u);
}

TEST_F(SegmentIndexTest, MeasuresAgesOverRunsAndOverARewrite) {
  {
    SegmentIndex index = opened();
    index.made("a.csv");
    index.advance(100);
    index.ended("a.csv", 7);
    index.advance(3600);
    index.advance(-50);
    EXPECT_EQ(index.age_s("a.csv"), 3600);
  }
  SegmentIndex again = opened();
  EXPECT_EQ(again.age_s("a.csv"), 3600);
  again.found("a.csv", 8);
  EXPECT_EQ(again.age_s("a.csv"), 3600);
  again.advance(10);
  for (int i = 0; i < 4000; ++i) {
    again.made("b.csv");
    again.deleted({"b.csv", 1, 77});
  }
  again.refresh({});
  EXPECT_EQ(opened().age_s("a.csv"), 3610);
  EXPECT_EQ(opened().deleted_before_s(), 77);
  EXPECT_EQ(opened().age_s("no.csv"), 0);
}

TEST_F(SegmentIndexTest, AnInterruptedDeletionIsOneForReaders) {
  SegmentIndex index = opened();
  index.made("a.csv");
  index.made("b.csv");
  index.deleting({"a.csv", 7, 5});
  SegmentIndex reader(path);
  ASSERT_TRUE(reader.read());
  reader.settle({"a.csv", "b.csv"});
  EXPECT_EQ(reader.number("a.csv"), 1u) << "the file is still there";
  const std::string text = test::content(path);
  reader.settle({"b.csv"});
  EXPECT_EQ(reader.number("a.csv"), 0u);
  EXPECT_EQ(reader.deleted_rows(), 7u);
  EXPECT_EQ(reader.deleted_before_s(), 5);
  EXPECT_EQ(test::content(path), text) << "a reader does not write";
}

TEST_F(SegmentIndexTest, ANameThatComesAgainIsAnotherSegment) {
  SegmentIndex index = opened();
  index.made("a.csv");
  index.deleted({"a.csv", 5});
  EXPECT_EQ(index.number("a.csv"), 0u);
  index.made("a.csv");
  EXPECT_EQ(index.number("a.csv"), 2u);
  EXPECT_EQ(opened().number("a.csv"), 2u);
}

// Directories of version 0.1 have no index.
TEST_F(SegmentIndexTest, SegmentsWithoutANumberGetOneInTheOrderGiven) {
  const SegmentIndex index = opened({"old-1.csv", "old-2.csv"});
  EXPECT_EQ(index.number("old-1.csv"), 1u);
  EXPECT_EQ(opened({"old-2.csv", "old-3.csv"}).number("old-3.csv"), 3u);
}

TEST_F(SegmentIndexTest, ATornLastLineCostsItselfOnly) {
  SegmentIndex index = opened();
  index.made("a.csv");
  const std::string text = test::content(path);
  for (std::size_t length = text.find('\n') + 1; length < text.size(); ++length) {
    test::write_file(path, text.substr(0, length));
    SegmentIndex torn = opened();
    torn.made("b.csv");
    EXPECT_EQ(torn.id(), index.id());
    EXPECT_EQ(opened().number("b.csv"), 1u) << text.substr(0, length);
  }
}

TEST_F(SegmentIndexTest, AnEmptiedFolderIsAnotherLog) {
  SegmentIndex index = opened();
  index.made("a.csv");
  const std::string before = index.id();
  std::filesystem::remove(path);
  index.refresh({});
  EXPECT_NE(index.id(), before);
  EXPECT_EQ(index.number("a.csv"), 0u);
}

TEST_F(SegmentIndexTest, AnIndexOfDamageIsMadeAnew) {
  test::write_file(path, "\xff\xfe no json\n{}\n");
  EXPECT_EQ(opened({"a.csv"}).number("a.csv"), 1u);
  EXPECT_EQ(opened().id().size(), 32u);
  EXPECT_THAT(test::content(path), HasSubstr("prism-segments"));
}

TEST_F(SegmentIndexTest, IsMadeLaterWhereTheFolderIsNotThereYet) {
  SegmentIndex index(folder.file("log") + "/gyro.csv.index");
  index.refresh({});
  index.made("a.csv");
  std::filesystem::create_directory(folder.file("log"));
  index.refresh({"a.csv"});
  EXPECT_THAT(test::content(folder.file("log") + "/gyro.csv.index"), HasSubstr("a.csv"));
}

TEST_F(SegmentIndexTest, ALinkInItsPlaceIsNotWrittenThrough) {
  const std::string target = folder.file("other");
  test::write_file(target, "theirs");
  std::filesystem::create_symlink(target, path);
  EXPECT_EQ(opened({"a.csv"}).number("a.csv"), 1u);
  EXPECT_EQ(test::content(target), "theirs");
  EXPECT_FALSE(std::filesystem::is_symlink(path));
}

TEST_F(SegmentIndexTest, DoesNotGrowForEver) {
  SegmentIndex index = opened();
  for (int i = 0; i < 4000; ++i) {
    index.made("a.csv");
    index.deleted({"a.csv", 10});
  }
  index.refresh({});
  EXPECT_LT(test::content(path).size(), 1000u);
  EXPECT_THAT(test::content(path), HasSubstr("\"deleted_segments\":4000,\"deleted_rows\":40000"));
  SegmentIndex again = opened();
  again.made("b.csv");
  EXPECT_EQ(again.number("b.csv"), 4001u);
}

}  // namespace
}  // namespace prism::pipeline
