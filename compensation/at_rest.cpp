// SPDX-License-Identifier: MIT
#include "compensation/at_rest.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prism::compensation {
namespace {

constexpr double kVaries = 1.5, kStep = 4;
constexpr double kFlicker = 2 * std::numbers::ln2 / std::numbers::pi;  // Allan variance of B = 1
constexpr double kSecondsPerHour = 3600;

// Of the rate's mean over `length_s`, (deg/h)².
double noise_variance(const RateNoise& noise, double length_s) {
  return noise.n_deg_per_sqrt_h * noise.n_deg_per_sqrt_h * kSecondsPerHour / length_s +
         kFlicker * noise.b_deg_per_h * noise.b_deg_per_h;
}

}  // namespace

std::optional<RateNoise> noise_of(const ModelInfo& info) {
  if (info.noise) return info.noise;
  if (!info.spread || !(info.spread->noise_deg_per_h > 0)) return std::nullopt;
  const double of_second = info.spread->noise_deg_per_h * std::sqrt(info.features.length_s);
  return RateNoise{of_second / std::sqrt(kSecondsPerHour), 0, of_second};
}

RestLimits rest_limits(const RateNoise& noise, double window_s) {
  return {kVaries * noise.second_deg_per_h, kStep * std::sqrt(2 * noise_variance(noise, window_s)),
          2 * kEarthRateDegPerH};
}

AtRest::AtRest(const std::optional<AxisPlacement>& placement, double direction_rad, const ModelPtr& model) {
  if (!placement) return;
  earth_rate_deg_per_h_ = compensation::earth_rate_deg_per_h(*placement);
  mount_sd_deg_per_h_ = mount_sd_deg_per_h(earth_rate_deg_per_h_, direction_rad);
  const auto noise = model ? noise_of(model->info()) : std::nullopt;
  reason_ = noise ? NoDifference::kTooLittle : NoDifference::kNoNoise;
  if (!noise) return;
  noise_ = *noise;
  length_s_ = model->info().features.length_s;
  limits_ = rest_limits(noise_, static_cast<double>(length_s_));
  most_ = std::max(kFewestBlocks, static_cast<std::size_t>((kSeenS + length_s_ - 1) / length_s_));
}

void AtRest::reset() {
  seconds_ = {};
  blocks_.clear();
  in_a_row_ = beyond_ = 0;
  if (length_s_ > 0) reason_ = NoDifference::kTooLittle;
}

bool AtRest::push(const CompensatedWindow& row) {
  if (length_s_ == 0) return false;
  if (row.correction.quality != kGood || row.window.state != WindowState::kReady ||
      !std::isfinite(row.correction.sd_deg_per_h)) {
    seconds_ = {};
    reason_ = row.correction.quality == kGood ? NoDifference::kNoNoise : NoDifference::kQuality;
    return false;
  }
  if (reason_ == NoDifference::kQuality) reason_ = NoDifference::kTooLittle;
  const std::int64_t second = row.window.second_mean.second;
  if (seconds_.count() == 0) begin_ = second;
  if (std::isfinite(row.corrected_deg_per_h)) seconds_.add(row.corrected_deg_per_h);
  if (second - begin_ + 1 < length_s_) return false;
  const double sd = row.correction.sd_deg_per_h, second_sd = seconds_.sd();
  seconds_ = {};
  take({second, row.corrected_mean_deg_per_h - earth_rate_deg_per_h_, sd * sd}, second_sd);
  return true;
}

void AtRest::take(const Block& block, double second_sd_deg_per_h) {
  const auto oldest = block.second - 2 * static_cast<std::int64_t>(most_) * length_s_;
  while (!blocks_.empty() && (blocks_.size() == most_ || blocks_.front().second <= oldest)) blocks_.pop_front();
  const double difference = block.difference_deg_per_h;
  if (!(second_sd_deg_per_h <= limits_.second_sd_deg_per_h && std::abs(difference) <= limits_.difference_deg_per_h)) {
    reason_ = NoDifference::kMoving;
    in_a_row_ = 0;
    return;
  }
  if (!blocks_.empty() && std::abs(difference - blocks_.back().difference_deg_per_h) > limits_.step_deg_per_h) {
    blocks_.clear();
    reason_ = NoDifference::kMoving;
    in_a_row_ = beyond_ = 0;
  }
  blocks_.push_back(block);
  if (++in_a_row_ < kFewestBlocks) return;
  reason_ = NoDifference::kNone;
  const Difference found = *this->difference();
  beyond_ = std::abs(found.deg_per_h) > kBeyond * found.sd_deg_per_h ? beyond_ + 1 : 0;
}

std::optional<bool> AtRest::differs() const {
  if (reason_ != NoDifference::kNone) return std::nullopt;
  if (beyond_ >= most_) return true;
  return beyond_ == 0 && blocks_.size() == most_ ? std::optional(false) : std::nullopt;
}

std::optional<AtRest::Difference> AtRest::difference() const {
  if (reason_ != NoDifference::kNone) return std::nullopt;
  const auto count = static_cast<double>(blocks_.size()), seen_s = count * static_cast<double>(length_s_);
  double mean = 0, variance = noise_variance(noise_, seen_s) + mount_sd_deg_per_h_ * mount_sd_deg_per_h_;
  for (const Block& block : blocks_) {
    mean += block.difference_deg_per_h / count;
    variance += block.variance / count;
  }
  return Difference{mean, std::sqrt(variance), static_cast<int>(blocks_.size()) * static_cast<int>(length_s_)};
}

}  // namespace prism::compensation
