// SPDX-License-Identifier: MIT
// A gyro at rest measures the Earth rate: the difference of its corrected rate from it is the model's error.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "compensation/block_stability.hpp"
#include "compensation/compensated.hpp"
#include "compensation/earth_rate.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

/// Why the difference is unknown.
enum class NoDifference {
  kNone,       ///< it is known
  kNoSite,     ///< the direction of the axis is not configured
  kNoNoise,    ///< no model, or one that states no noise or no standard deviation
  kQuality,    ///< the last correction is not good: warming, outside the training range, …
  kMoving,     ///< the rate varies more than the gyro's noise explains
  kTooLittle,  ///< less than kFewestBlocks windows at rest in a row
};
inline constexpr std::array kNoDifferenceNames = {"", "no_site", "no_noise", "quality", "moving", "too_little"};

/// The noise that a model states; one without states that of a window's mean, taken as white.
std::optional<RateNoise> noise_of(const ModelInfo& info);

/// Limits of a gyro at rest, deg/h.
struct RestLimits {
  double second_sd_deg_per_h;   ///< of one-second means within a window
  double step_deg_per_h;        ///< between the means of neighbouring windows
  double difference_deg_per_h;  ///< of a mean from the Earth rate
};
RestLimits rest_limits(const RateNoise& noise, double window_s);

/// Takes the rows of one axis and keeps the last half hour at rest, in blocks of a window's length.
///
/// At rest: the one-second means of the block vary at most 1.5 times as much as in the training, and its mean differs
/// from that of the block before by at most 4 standard deviations of the noise; a rate that differs from the Earth rate
/// by more than twice that rate is a rotation. A constant rotation below it cannot be distinguished from a bias.
///
/// The variance of the difference: sd² of the model (the same error in all blocks), N²/t + B² 2 ln 2 / π of the rate,
/// and (direction · Ω sin θ)² of the axis at the angle θ to the Earth's.
class AtRest {
 public:
  static constexpr int kSeenS = 1800;              ///< averaged at most
  static constexpr std::size_t kFewestBlocks = 5;  ///< in a row: a slow swing has fewer near its turning points
  static constexpr double kBeyond = 3;             ///< standard deviations that model and mount do not explain

  struct Difference {
    double deg_per_h, sd_deg_per_h;  ///< mean of the corrected rate − Earth rate
    int seen_s;                      ///< averaged time at rest
  };

  AtRest() = default;
  /// `placement`: nullopt if unknown. `direction_rad`: standard deviation of the axis's direction, each way.
  AtRest(const std::optional<AxisPlacement>& placement, double direction_rad, const ModelPtr& model);

  /// Rows in order of time. Returns true if the row ended a block, so that difference() may have changed.
  bool push(const CompensatedWindow& row);
  /// A new session: nothing seen yet.
  void reset();

  NoDifference reason() const { return reason_; }
  double earth_rate_deg_per_h() const { return earth_rate_deg_per_h_; }  ///< kUnknown without a site
  std::optional<Difference> difference() const;
  /// Returns true if the difference was beyond kBeyond sd for half an hour at rest, false if that of the last half hour
  /// is within; nullopt: undecided.
  std::optional<bool> differs() const;

 private:
  struct Block {
    std::int64_t second;
    double difference_deg_per_h, variance;  ///< of the model's error
  };
  void take(const Block& block, double second_sd_deg_per_h);

  NoDifference reason_ = NoDifference::kNoSite;
  double earth_rate_deg_per_h_ = kUnknown, mount_sd_deg_per_h_ = 0;
  RateNoise noise_;
  RestLimits limits_{};
  std::int64_t length_s_ = 0;
  std::size_t most_ = 0;
  RunningVariance seconds_;   ///< of the open block
  std::int64_t begin_ = 0;    ///< its first second
  std::size_t in_a_row_ = 0;  ///< blocks at rest since the last one that was not
  std::size_t beyond_ = 0;    ///< blocks in a row after which the difference was beyond kBeyond sd
  std::deque<Block> blocks_;
};

}  // namespace prism::compensation
