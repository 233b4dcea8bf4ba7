// SPDX-License-Identifier: MIT
#include "tools/prismsim/simulation/simulated_line.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prism::simulation {
namespace {

constexpr double kLeastOutlier_arcsec = 2, kMostOutlier_arcsec = 10;

struct Axis {
  double body_lag_s, thermal_share;
};
constexpr Axis kAxes[wire::kMaxAxes] = {{65 * 60, 1}, {52 * 60, -1.6}, {81 * 60, 2.2}, {70 * 60, 1.3}};
constexpr std::uint64_t kHiddenSeeds = 1'000'003;  // between axes
constexpr std::uint64_t kFirstNoise = 1, kFurtherNoise = 20;

}  // namespace

SimulatedLine::SimulatedLine(wire::FrameDescriptionPtr description, const SimulationSettings& settings)
    : settings_(settings),
      period_s_(1 / settings.rate_hz),
      encoder_(description),
      outliers_(settings.seed, 2),
      losses_(settings.seed, 3),
      line_(settings.seed, 4),
      description_(description),
      spreads_(description->axes.size()) {
  for (std::size_t i = 0; i < std::max<std::size_t>(description->axes.size(), 1); ++i) {
    BiasModelSettings truth = settings.truth;
    truth.axis = {kAxes[i].body_lag_s, kAxes[i].thermal_share, i * kHiddenSeeds};
    gyros_.emplace_back(settings.profile, settings.seed, truth);
    noise_.emplace_back(settings.seed, i == 0 ? kFirstNoise : kFurtherNoise + i);
  }
}

std::int64_t SimulatedLine::time_ns() const {
  return std::llround(static_cast<double>(counters_.frames) * (1e9 / settings_.rate_hz));
}

double SimulatedLine::outlier_arcsec() {
  if (!outliers_.chance(settings_.outliers_per_h * period_s_ / 3600)) return 0;
  ++counters_.outliers;
  const double size = kLeastOutlier_arcsec + (kMostOutlier_arcsec - kLeastOutlier_arcsec) * outliers_.uniform();
  return outliers_.uniform() < 0.5 ? -size : size;
}

void SimulatedLine::next_frame(std::vector<std::uint8_t>& out) {
  for (SimulatedGyro& gyro : gyros_) gyro.step(period_s_);
  ++counters_.frames;
  wire::GyroState state;
  state.interval_s = period_s_;
  for (std::size_t i = 0; i < gyros_.size(); ++i)
    state.rate_deg_per_h[i] = settings_.earth_rate_deg_per_h[i] + truth(i).bias_deg_per_h +
                              kRateNoise_deg_per_h_sqrt_s / std::sqrt(period_s_) * noise_[i].normal() +
                              outlier_arcsec() / period_s_;
  const double time_s = truth().time_s;
  for (const InvalidTime& time : settings_.invalid)
    state.valid[time.axis] = state.valid[time.axis] && !(time_s >= time.from_s && time_s < time.to_s);
  for (std::size_t i = 0; i < description_->sensors().size(); ++i) state.sensors[i] = sensor_value(i);
  add_parts();
  state.temperature_degc = truth().sensor_degc;
  state.uhfo_v = truth().uhfo_v;
  if (losses_.chance(settings_.lose_frames)) {
    ++counters_.lost_frames;
    encoder_.skip(state, 1);
    return;
  }
  const std::size_t from = out.size();
  encoder_.encode(state, out);
  spoil(out, from);
}

double SimulatedLine::sensor_value(std::size_t sensor) const {
  for (std::size_t i = 0; i < description_->axes.size(); ++i) {
    if (description_->axes[i].thermometer == static_cast<int>(sensor)) return truth(i).sensor_degc;
  }
  const std::string& unit = description_->sensors()[sensor].sensor.unit;
  if (unit == "degC") return truth().case_degc;
  return unit == "Pa" ? 101'325 : unit == "V" ? 5 : 1;
}

void SimulatedLine::add_parts() {
  const auto second = static_cast<std::int64_t>(truth().time_s);
  if (second == seconds_) return;
  seconds_ = second;
  for (std::size_t i = 0; i < spreads_.size(); ++i) {
    const BiasComponents& causes = truth(i).causes;
    const double parts[] = {causes.thermal, causes.gradient, causes.hidden()};
    for (std::size_t k = 0; k < spreads_[i].size(); ++k) spreads_[i][k].add(parts[k]);
  }
}

double SimulatedLine::RunningMoments::sd(double count) const {
  return count > 0 ? std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count))) : 0;
}

std::vector<BiasParts> SimulatedLine::parts() const {
  const auto count = static_cast<double>(seconds_);
  std::vector<BiasParts> parts;
  for (const auto& spreads : spreads_)
    parts.push_back({spreads[0].sd(count), spreads[1].sd(count), spreads[2].sd(count)});
  return parts;
}

void SimulatedLine::spoil(std::vector<std::uint8_t>& bytes, std::size_t from) {
  if (settings_.drop_bytes <= 0 && settings_.damage_bytes <= 0) return;
  std::size_t kept = from;
  for (std::size_t i = from; i < bytes.size(); ++i) {
    if (line_.chance(settings_.drop_bytes)) {
      ++counters_.dropped_bytes;
      continue;
    }
    bytes[kept] = bytes[i];
    if (line_.chance(settings_.damage_bytes)) {
      ++counters_.damaged_bytes;
      bytes[kept] ^= static_cast<std::uint8_t>(1 + static_cast<int>(line_.uniform() * 255));
    }
    ++kept;
  }
  bytes.resize(kept);
}

}  // namespace prism::simulation
