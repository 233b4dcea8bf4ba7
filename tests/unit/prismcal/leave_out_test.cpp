// SPDX-License-Identifier: MIT
// The range that a remark advises leaves out exactly the seconds that the remark names.
#include <gtest/gtest.h>

#include "tools/prismcal/findings.hpp"

namespace prism::recordings {
namespace {

constexpr std::int64_t kDay = 1'795'392'000;  // 2026-11-23

void expect_exact(std::int64_t first, std::int64_t last, bool is_date) {
  LeaveOut leave_out({leave_out_range(first, last, is_date)});
  ASSERT_TRUE(leave_out.begin(first - 100, is_date));
  for (std::int64_t second = first - 2; second <= last + 2; ++second)
    EXPECT_EQ(leave_out.contains(second), second >= first && second <= last) << second - first;
}

TEST(LeaveOut, ReadsTheRangesThatRemarksAdvise) {
  EXPECT_EQ(leave_out_range(kDay + 33'059, kDay + 33'119, true), "2026-11-23T09:11:00Z..2026-11-23T09:12:00Z");
  EXPECT_EQ(leave_out_range(7000, 7030, false), "7001..7031");
  EXPECT_EQ(end_of_second(kDay + 33'059, true), "2026-11-23T09:11:00Z");
  EXPECT_EQ(end_of_second(7000, false), "7001 s");
  expect_exact(kDay, kDay + 3, true);
  expect_exact(7000, 7003, false);
}

TEST(LeaveOut, RefusesWhatIsNoRange) {
  for (const char* text : {"", "..", "7", "a..b", "8..7", "2026-11-23T09:12:00Z..2026-11-23T09:11:00Z"})
    EXPECT_FALSE(LeaveOut({text}).begin(0, true)) << text;
  EXPECT_FALSE(LeaveOut({"2026-11-23T09:11:00Z.."}).begin(0, false)) << "the times of the recording have no date";
}

}  // namespace
}  // namespace prism::recordings
