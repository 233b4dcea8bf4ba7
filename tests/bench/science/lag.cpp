// SPDX-License-Identifier: MIT
// A thermometer outside the gyro: trained on one cycle, tested on another day, by the time constant of its response.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "compensation/training/response.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

struct Tested {
  double gain = 0, covered = 0;
};

double cpu_s(std::clock_t begin) { return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; }

/// Its blocks with T and dTdt, and with U if `uhfo`.
training::TrainingData blocks(const Cycle& cycle, int tau_s, bool uhfo) {
  training::TrainingData data = cycle.blocks(tau_s);
  if (uhfo) return data;
  data.names.pop_back();
  data.inputs.conservativeResize(2, Eigen::NoChange);
  return data;
}

Tested tested(const training::TrainingData& cycle, const training::TrainingData& test, double& training_s) {
  const Contender& ours = kContenders.front();
  const std::clock_t begin = std::clock();
  const compensation::ModelPtr model = trained(ours, cycle);
  training_s += cpu_s(begin);
  const Served served = serve(*model, test, ours.policy);
  return {gained(test, served.bias), covered(test.target - served.bias, served.sd_mean)};
}

}  // namespace

int lag(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | inputs | thermometer | body, s | seed | found, s (95 %) | gain | improvement | as measured | best "
      "fixed | its "
      "s "
      "| within 2 sd_mean |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  double search_s = 0, training_s = 0, all_covered = 0, worst = 0, inside_worst = 0;
  std::vector<double> lost, inside_lost, lost_without_uhfo;
  int trainings = 0, cases = 0;
  const auto run = [&](const Truth& truth, bool uhfo, int body_s, std::uint64_t seed) {
    simulation::BiasModelSettings settings = truth.settings;
    settings.thermometer_in_air = body_s > 0;
    if (body_s > 0) settings.axis.body_lag_s = body_s;
    const Cycle cycle = simulate_cycle(simulation::paper_profile(), settings, seed);
    const Cycle day = simulate_cycle(simulation::paper_profile(), settings, seed + 1);
    const training::TrainingData measured = blocks(cycle, 0, uhfo);
    const std::clock_t begin = std::clock();
    const training::ResponseSearch found =
        training::find_response(measured, {}, 100).value_or(training::ResponseSearch{});
    search_s += cpu_s(begin);
    const auto test = [&](int tau_s) {
      ++trainings;
      return tested(blocks(cycle, tau_s, uhfo), blocks(day, tau_s, uhfo), training_s);
    };
    const Tested ours = test(found.tau_s), none = found.tau_s > 0 ? test(0) : ours;
    double best = std::max(none.gain, ours.gain);
    int best_s = none.gain >= ours.gain ? 0 : found.tau_s;
    for (const int percent : uhfo ? std::vector{50, 75, 100, 150} : std::vector{100}) {
      const int tau_s = body_s * percent / 100;
      if (tau_s == 0) continue;
      if (const double gain = test(tau_s).gain; gain > best) best = gain, best_s = tau_s;
    }
    (body_s == 0 ? inside_lost : uhfo ? lost : lost_without_uhfo).push_back(best - ours.gain);
    all_covered += ours.covered;
    ++cases;
    fmt::print("| {} | {} | {} | {} | {} | {} ({:.0f} to {:.0f}) | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} | {:.1f} |\n",
               truth.name, uhfo ? "T, dTdt, U" : "T, dTdt", body_s > 0 ? "air" : "body", body_s, seed, found.tau_s,
               found.low_s, found.high_s, found.gain, 100 * ours.gain, 100 * none.gain, 100 * best, best_s,
               100 * ours.covered);
    std::fflush(stdout);
  };
  for (const Truth& truth : truths()) {
    if (truth.settings.smooth) continue;
    for (int s = 0; s < count; ++s) {
      const std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
      for (const int body_s : {0, 300, 900, 1800, 3900, 7200}) run(truth, true, body_s, seed);
      for (const int body_s : {0, 1800, 7200}) run(truth, false, body_s, seed);
    }
  }
  for (const double l : lost) worst = std::max(worst, l);
  for (const double l : inside_lost) inside_worst = std::max(inside_worst, l);
  all_covered /= cases;
  const double ratio = 1 + search_s / cases / (training_s / trainings);
  bar("lost to the best fixed time constant, mean", fmt::format("{:.2f} points", 100 * mean(lost)), "at most 1.5",
      mean(lost) <= 0.015);
  bar("the same, the worst", fmt::format("{:.1f} points", 100 * worst), "at most 6", worst <= 0.06);
  bar("the same without U, mean", fmt::format("{:.2f} points", 100 * mean(lost_without_uhfo)), "at most 1.5",
      mean(lost_without_uhfo) <= 0.015);
  bar("lost with the thermometer in the body, the worst", fmt::format("{:.1f} points", 100 * inside_worst), "at most 1",
      inside_worst <= 0.01);
  bar("blocks within 2 sd_mean", fmt::format("{:.1f} %", 100 * all_covered), "92 to 98 %",
      all_covered >= 0.92 && all_covered <= 0.98);
  bar("processor time of search and training to that of training", fmt::format("{:.2f}", ratio), "at most 3",
      ratio <= 3);
  return 0;
}

}  // namespace prism::science
