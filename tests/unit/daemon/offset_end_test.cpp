// SPDX-License-Identifier: MIT
// An offset by command ends at its expiry, also if the host's clock is set back, and with its model.
#include <gtest/gtest.h>

#include <string>

#include "daemon/pipeline/device.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/models.hpp"

namespace prism::pipeline {
namespace {

/// A device with a model and an offset of 8 h.
struct OffsetInUse : test::DaemonPartsTest {
  OffsetInUse() {
    setup_.axes[0].model = test::linear_model({"T"}, {1});
    parts_ = std::make_unique<test::DaemonParts>(setup_);
    device().call_at_end_of_offsets([this](std::size_t, const Offset&) { ++ended; });
    use(setup_.axes[0].model->info().id);
  }
  Device& device() { return parts_->device; }
  bool in_use() { return device().axes[0].offset.has_value(); }
  void use(const std::string& model) {
    device().use_offset(0, Offset{0.002, "turn-on", model, kSet_s, kSet_s + 8 * kHour_s}, "set");
  }

  static constexpr std::int64_t kSet_s = 1'700'000'000, kHour_s = 3600;
  int ended = 0;
};

TEST_F(OffsetInUse, EndsAtItsExpiry) {
  device().end_offsets(kSet_s, 1000);
  device().end_offsets(kSet_s + 8 * kHour_s - 1, 1000 + 8 * kHour_s - 1);
  EXPECT_TRUE(in_use());
  device().end_offsets(kSet_s + 8 * kHour_s, 1000 + 8 * kHour_s - 1);
  EXPECT_FALSE(in_use());
  EXPECT_EQ(ended, 1);
}

TEST_F(OffsetInUse, EndsInTimeIfTheClockIsSetBack) {
  device().end_offsets(kSet_s + kHour_s, 1000);
  device().end_offsets(kSet_s - 90 * kHour_s, 1000 + 7 * kHour_s - 1);
  EXPECT_TRUE(in_use());
  device().end_offsets(kSet_s - 89 * kHour_s, 1000 + 7 * kHour_s);
  EXPECT_FALSE(in_use());
  use(setup_.axes[0].model->info().id);  // restored, with a clock before it was set: not longer than its own time
  device().end_offsets(kSet_s - 90 * kHour_s, 1000);
  device().end_offsets(kSet_s - 82 * kHour_s, 1000 + 8 * kHour_s);
  EXPECT_FALSE(in_use());
}

TEST_F(OffsetInUse, EndsWithItsModel) {
  use("another");
  EXPECT_FALSE(in_use());
  EXPECT_EQ(ended, 1);
  use(setup_.axes[0].model->info().id);
  setup_.axes[0].model = test::linear_model({"T"}, {2});
  ASSERT_TRUE(device().reconfigure(setup_));
  EXPECT_FALSE(in_use());
}

}  // namespace
}  // namespace prism::pipeline
