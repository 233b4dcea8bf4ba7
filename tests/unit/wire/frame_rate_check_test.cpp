// SPDX-License-Identifier: MIT
// Described and arrival times of frames: when they differ, and what must not be taken for a difference
// (frame_rates.txt).
#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "drivers/clock.hpp"
#include "tests/support/blocks.hpp"

namespace prism::drivers {
namespace {

struct Frames {
  FrameRateCheck check{0, 200, 0.004};
  double now_s = 1.8e9;

  void step(const std::string& line) {
    std::istringstream words(line);
    std::string what;
    double value = 0, more = 0;
    words >> what >> value >> more;
    if (what == "frames") {
      for (const double end_s = now_s + value; now_s < end_s;) check.push(0.005, now_s += 1 / more);
    } else if (what == "batches") {
      for (int batch = 0; batch < value / 3; ++batch) {
        now_s += 3;
        for (int i = 0; i < 600; ++i) check.push(0.005, now_s);
        EXPECT_FALSE(check.differs()) << batch;
      }
    } else if (what == "arrival") {
      now_s += value;
    } else if (what == "described") {
      check.push(value, now_s += 0.005);
    } else if (what == "steps") {
      std::vector<double> steps{more};
      for (double next = 0; words >> next;) steps.push_back(next);
      for (std::size_t i = 0; i < static_cast<std::size_t>(value); ++i) check.push_tagged(steps[i % steps.size()]);
    } else if (what == "tagged") {
      EXPECT_NEAR(check.tagged_hz(), value, 0.1);
    } else if (what == "session") {
      check.begin();
    } else if (what == "tolerance") {
      check = FrameRateCheck(value, 200, 0.004);
    } else if (what == "ratio") {
      EXPECT_NEAR(check.ratio(), value, more);
    } else {
      ASSERT_TRUE(what == "agrees" || what == "differs") << what;
      EXPECT_EQ(check.differs(), what == "differs");
    }
  }
};

TEST(FrameRateCheck, FindsDifferencesAndNothingElse) {
  for (const test::Block& block : test::blocks("wire/frame_rates.txt", -2)) {
    Frames frames;
    for (std::size_t i = 1; i < block.lines.size(); ++i) {
      SCOPED_TRACE(block.where + ": " + block[0] + ", step " + std::to_string(i) + ": " + block[i]);
      frames.step(block[i]);
    }
  }
}

}  // namespace
}  // namespace prism::drivers
