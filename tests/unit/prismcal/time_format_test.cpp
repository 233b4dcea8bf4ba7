// SPDX-License-Identifier: MIT
// A time whose nanoseconds do not fit 64 bits is rejected; before, it became another time.
#include "tools/prismcal/tables/time_format.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace prism::tables {
namespace {

TEST(TimeFormat, RejectsTimesBeyond285Years) {
  TimeFormat format;
  format.kind = TimeKind::kGps;
  format.second = 1;
  EXPECT_EQ(format.parse("2307", "5.5"), 1711238405'500'000'000);
  for (const auto& [week, second] : {std::pair{"23550", "0"}, {"-99999", "0"}, {"2307", "1e10"}, {"1e300", "-1e300"}})
    EXPECT_FALSE(format.parse(week, second)) << week << " " << second;
  format.second.reset();
  for (const TimeKind kind :
       {TimeKind::kNumber, TimeKind::kUnix, TimeKind::kExcel, TimeKind::kDatenum, TimeKind::kLabview}) {
    format.kind = kind;
    EXPECT_FALSE(format.from_number(1e17, 0));
    EXPECT_FALSE(format.from_number(std::numeric_limits<double>::quiet_NaN(), 0));
  }
}

}  // namespace
}  // namespace prism::tables
