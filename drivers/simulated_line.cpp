// SPDX-License-Identifier: MIT
#include "drivers/simulated_line.hpp"

#include <cmath>
#include <utility>

namespace prism::drivers {
namespace {

constexpr double kLeastOutlier_arcsec = 2, kMostOutlier_arcsec = 10;

}  // namespace

SimulatedLine::SimulatedLine(wire::FrameDescriptionPtr description, const SimulationSettings& settings)
    : settings_(settings),
      period_s_(1 / settings.rate_hz),
      gyro_(settings.profile, settings.seed, settings.truth),
      encoder_(std::move(description)),
      noise_(settings.seed, 1),
      outliers_(settings.seed, 2),
      losses_(settings.seed, 3),
      line_(settings.seed, 4) {}

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
  const GyroTruth& truth = gyro_.step(period_s_);
  ++counters_.frames;
  wire::GyroState state;
  state.interval_s = period_s_;
  state.rate_deg_per_h = settings_.earth_rate_deg_per_h + truth.bias_deg_per_h +
                         kRateNoise_deg_per_h_sqrt_s / std::sqrt(period_s_) * noise_.normal() +
                         outlier_arcsec() / period_s_;
  state.temperature_degc = truth.sensor_degc;
  state.uhfo_v = truth.uhfo_v;
  if (losses_.chance(settings_.lose_frames)) {
    ++counters_.lost_frames;
    encoder_.skip(state, 1);
    return;
  }
  const std::size_t from = out.size();
  encoder_.encode(state, out);
  spoil(out, from);
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

}  // namespace prism::drivers
