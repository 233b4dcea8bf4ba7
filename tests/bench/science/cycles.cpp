// SPDX-License-Identifier: MIT
// One, two and three cycles of a gyro, each after its own switch-on; and the best that temperature alone could do.
#include <fmt/format.h>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr int kMostCycles = 3;

training::TrainingData joined(const std::vector<training::TrainingData>& cycles, int count) {
  training::TrainingData all = cycles.front();
  for (int k = 1; k < count; ++k) {
    const training::TrainingData& next = cycles[static_cast<std::size_t>(k)];
    const Eigen::Index n = all.target.size(), m = next.target.size();
    all.inputs.conservativeResize(Eigen::NoChange, n + m);
    all.inputs.rightCols(m) = next.inputs;
    all.target.conservativeResize(n + m);
    all.target.tail(m) = next.target;
    all.time_s.conservativeResize(n + m);
    all.time_s.tail(m) = next.time_s;
    all.runs.insert(all.runs.end(), static_cast<std::size_t>(m), k);
  }
  return all;
}

double gained(const Record& test, const Eigen::VectorXd& prediction) {
  const Eigen::VectorXd error = test.data.target - prediction;
  return improvement(test.data.target.array() - test.data.target.mean(), error.array() - error.mean());
}

}  // namespace

int cycles(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | profile | 1 cycle | 2 cycles | 3 cycles | 3, within 2 sd_mean, % | the thermal truth |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Truth& truth : truths()) {
    const simulation::ChamberProfile profiles[] = {simulation::paper_profile(), simulation::second_profile(),
                                                   simulation::third_profile()};
    std::vector<double> gain[3][kMostCycles], inside[3], best[3];
    for (int s = 0; s < count; ++s) {
      std::uint64_t seed = first_seed + 20 * static_cast<std::uint64_t>(s);
      std::vector<training::TrainingData> days;
      for (int k = 0; k < kMostCycles; ++k)
        days.push_back(simulate(simulation::paper_profile(), truth.settings, seed++).data);
      std::vector<Record> tests;
      for (const auto& profile : profiles) tests.push_back(simulate(profile, truth.settings, seed++));
      for (int k = 0; k < kMostCycles; ++k) {
        const auto model = trained(kContenders.front(), joined(days, k + 1));
        for (std::size_t p = 0; p < 3; ++p) {
          const Served served = serve(*model, tests[p].data, kContenders.front().policy);
          gain[p][k].push_back(gained(tests[p], served.bias));
          if (k + 1 < kMostCycles) continue;
          inside[p].push_back(covered(tests[p].data.target - served.bias, served.sd_mean));
          best[p].push_back(gained(tests[p], tests[p].thermal_deg_per_h));
        }
      }
    }
    for (std::size_t p = 0; p < 3; ++p) {
      fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", truth.name, profiles[p].name,
                 100 * mean(gain[p][0]), 100 * mean(gain[p][1]), 100 * mean(gain[p][2]), 100 * mean(inside[p]),
                 100 * mean(best[p]));
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace prism::science
