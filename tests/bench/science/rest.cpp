// SPDX-License-Identifier: MIT
// Switch-ons of gyros with good models, with a moved bias, and that are not at rest: which raise the problem?
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "compensation/at_rest.hpp"
#include "compensation/compensation_engine.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr double kMount_rad = 1e-3;
constexpr int kRuns = 25, kHours = 6;  // of each model; to the steady temperature

/// A rate that is added to the gyro's, deg/h, by the second.
using Motion = std::function<double(int second)>;
Motion still(double offset_deg_per_h) {
  return [=](int) { return offset_deg_per_h; };
}

struct Outcome {
  std::optional<int> problem_s;  ///< when it begins
  int known_s = 0;               ///< seconds with a difference
  double largest = 0;            ///< |difference| / sd, of the last half hour
};

/// A switch-on at the chamber's temperature. The gyro has an offset as the model states it, and its axis an error of
/// kMount_rad.
Outcome switch_on(const compensation::ModelPtr& model, const simulation::BiasModelSettings& truth, std::uint64_t seed,
                  const Motion& motion, int seconds) {
  simulation::RandomSource random(seed, 11);
  const double chamber_degc = -30 + 85 * random.uniform();
  simulation::SimulatedGyro gyro({"switch-on", chamber_degc, {{double(seconds), chamber_degc}}}, seed, truth);
  const compensation::AxisPlacement up;
  compensation::AtRest rest(up, kMount_rad, model);
  const auto& spread = *model->info().spread;
  const double mount =
      kMount_rad * compensation::kEarthRateDegPerH * std::cos(up.latitude_deg * std::numbers::pi / 180);
  const double moved = spread.factor * spread.offset_deg_per_h * random.normal() + mount * random.normal();
  compensation::CompensationEngine engine;
  (void)engine.use(model, nullptr);
  compensation::FeatureExtractor extractor(model->info().features);
  compensation::CompensatedWindow row;
  Outcome outcome;
  int ready = 0;
  for (int second = 0; second < seconds; ++second) {
    const simulation::GyroTruth& now = gyro.step(1);
    const double rate_deg_per_h = rest.earth_rate_deg_per_h() + now.bias_deg_per_h + moved + motion(second);
    const compensation::SecondMean mean = measured(now, second, rate_deg_per_h, random);
    row.window = extractor.push(mean);
    // The model's correction only where a block ends: its standard deviation is expensive.
    const int length = model->info().features.length_s;
    ready += row.window.state == compensation::WindowState::kReady;
    if (ready <= 1 || ready % length == 0) row.correction = engine.correct(row.window);
    row.corrected_deg_per_h = corrected_rate(mean.rate_deg_per_h, row.correction);
    row.corrected_mean_deg_per_h = corrected_rate(row.window.rate_deg_per_h, row.correction);
    const bool ended = rest.push(row);
    outcome.known_s += rest.reason() == compensation::NoDifference::kNone;
    const auto found = rest.difference();
    if (!ended || !found) continue;
    if (found->seen_s == compensation::AtRest::kSeenS)
      outcome.largest = std::max(outcome.largest, std::abs(found->deg_per_h) / found->sd_deg_per_h);
    if (rest.differs() == true && !outcome.problem_s) outcome.problem_s = second;
  }
  return outcome;
}

compensation::ModelPtr model_of(const simulation::BiasModelSettings& truth, std::uint64_t seed) {
  compensation::ModelInfo info;
  info.noise = {simulation::kRateNoise_deg_per_h_sqrt_s / 60, 0, simulation::kRateNoise_deg_per_h_sqrt_s};
  training::TrainingSettings settings;
  settings.threads = 1;
  auto trained = training::train(simulate(simulation::paper_profile(), truth, seed).data, info, settings);
  return trained ? trained->model : nullptr;
}

/// Steps of the angle are in deg/h over one second.
std::vector<std::pair<const char*, Motion>> motions() {
  const auto swing = [](double deg_per_h, double period_s) -> Motion {
    return [=](int s) { return deg_per_h * std::sin(2 * std::numbers::pi * s / period_s); };
  };
  return {{"swing of 0.2 deg/h in 3 s", swing(0.2, 3)},
          {"swing of 0.2 deg/h in 30 s", swing(0.2, 30)},
          {"swing of 0.2 deg/h in 300 s", swing(0.2, 300)},
          {"swing of 0.2 deg/h in 30 min", swing(0.2, 1800)},
          {"knock of 10 arcsec every 40 s", [](int s) { return s % 40 == 0   ? 10.0
                                                               : s % 40 == 1 ? -10.0
                                                                             : 0.0; }},
          {"turn of 1 deg every 90 s", [](int s) { return s % 90 == 0 ? 3600.0 : 0.0; }},
          {"constant turn of 0.01 deg/s", still(36)}};
}

}  // namespace

int rest(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | switch-ons | problem, % | 99 % of the largest differences below, sd | known, % of the time | "
      "0.1 deg/h off: problem in an hour, % |\n| --- | --- | --- | --- | --- | --- |\n");
  int all = 0, alarms = 0, found = 0;
  for (const Truth& truth : truths()) {
    if (truth.settings.smooth) continue;
    std::vector<double> largest;
    double known_s = 0;
    int runs = 0, raised = 0, in_time = 0;
    for (int s = 0; s < count; ++s) {
      const std::uint64_t seed = first_seed + 1000 * static_cast<std::uint64_t>(s);
      const compensation::ModelPtr model = model_of(truth.settings, seed);
      if (!model) return 1;
      for (std::uint64_t run = 1; run <= kRuns; ++run, ++runs) {
        const Outcome good = switch_on(model, truth.settings, seed + run, still(0), kHours * 3600);
        largest.push_back(good.largest);
        known_s += good.known_s;
        raised += good.problem_s.has_value();
        const Outcome off = switch_on(model, truth.settings, seed + run, still(run % 2 ? 0.1 : -0.1), 3600);
        in_time += off.problem_s.has_value();
      }
    }
    std::sort(largest.begin(), largest.end());
    fmt::print("| {} | {} | {:.1f} | {:.2f} | {:.0f} | {:.1f} |\n", truth.name, runs, 100.0 * raised / runs,
               largest[static_cast<std::size_t>(0.99 * (runs - 1))], 100 * known_s / (3600.0 * kHours * runs),
               100.0 * in_time / runs);
    std::fflush(stdout);
    all += runs, alarms += raised, found += in_time;
  }
  const auto share = [all](int part) { return 100.0 * part / all; };
  bar("switch-ons of good models with a problem", fmt::format("{} of {}", alarms, all), "1 %", share(alarms) <= 1);
  bar("biases off by 0.1 deg/h with one in an hour", fmt::format("{:.1f} %", share(found)), "95 %", share(found) >= 95);
  const compensation::ModelPtr model = model_of({}, first_seed);
  fmt::print("\n| not at rest | taken as at rest, % of the time | problem |\n| --- | --- | --- |\n");
  for (const auto& [name, motion] : motions()) {
    const Outcome moving = switch_on(model, {}, first_seed + 1, motion, kHours * 3600);
    fmt::print("| {} | {:.0f} | {} |\n", name, moving.known_s / (36.0 * kHours), moving.problem_s ? "yes" : "no");
  }
  return 0;
}

}  // namespace prism::science
