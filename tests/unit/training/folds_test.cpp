// SPDX-License-Identifier: MIT
#include "compensation/training/folds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace prism::training {
namespace {

TEST(Folds, ShuffledOnesAreAPermutationOfLsSvmlabsCut) {
  const Folds folds = shuffled_folds(103, 10, 7);
  const auto members = fold_members(folds);
  ASSERT_EQ(members.size(), 10u);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(members[i].size(), 10u);
  EXPECT_EQ(members[9].size(), 13u);
  EXPECT_EQ(folds, shuffled_folds(103, 10, 7));
  EXPECT_NE(folds, shuffled_folds(103, 10, 8));
}

TEST(Folds, BlocksAreContiguousWithinOneRun) {
  std::vector<int> runs(90, 0);
  runs.resize(120, 1);
  const Folds folds = blocked_folds(runs, 8);
  EXPECT_TRUE(std::is_sorted(folds.begin(), folds.end()));
  EXPECT_NE(folds[89], folds[90]);
  EXPECT_EQ(fold_count(folds), 8);
  EXPECT_EQ(folds[89], 5);  // three quarters of the samples take three quarters of the folds
}

TEST(Folds, EveryRunHasAFold) {
  const Folds folds = blocked_folds({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, 3);
  EXPECT_NE(folds[9], folds[10]);
}

TEST(Folds, ColumnsOfAnyIntegersBecomeFoldsFromZero) {
  const auto folds = folds_from({7, -1, 7, 3});
  ASSERT_TRUE(folds);
  EXPECT_EQ(*folds, (Folds{2, 0, 2, 1}));
  EXPECT_FALSE(folds_from({1, 1, 1}));
  EXPECT_FALSE(folds_from({1, 1.5}));
}

}  // namespace
}  // namespace prism::training
