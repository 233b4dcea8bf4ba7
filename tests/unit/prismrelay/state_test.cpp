// SPDX-License-Identifier: MIT
#include "tools/prismrelay/state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace prism::prismrelay {
namespace {

using testing::HasSubstr;

TEST(RelayState, LogsARepeatedErrorOnceWithItsCount) {
  RelayState state;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 5; ++i) state.down("postgresql", "postgresql: no");
  state.down("postgresql", "postgresql: other");
  for (int i = 0; i < 3; ++i) state.down("postgresql", "postgresql: other");
  state.up("postgresql");
  state.up("postgresql");
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 3) << log;
  EXPECT_THAT(log, HasSubstr("postgresql: no; retrying\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: other; retrying (the error before was repeated 4 times)\n"));
  EXPECT_THAT(log, HasSubstr("postgresql: connected; the last error was repeated 3 times\n"));
  EXPECT_EQ(state.view().targets.at("postgresql").failures, 9u);
}

}  // namespace
}  // namespace prism::prismrelay
