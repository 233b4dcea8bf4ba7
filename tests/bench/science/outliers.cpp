// SPDX-License-Identifier: MIT
// Outliers in a tenth of a cycle's blocks: by how much they change the predictions for another day.
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr double kNoise_deg_per_h = 0.0064;  // of a block's mean

struct Pollution {
  const char* name;
  Eigen::Index burst;
  double noises;
  bool one_side;
};
constexpr Pollution kPollutions[] = {{"isolated, 10", 1, 1e1, false},
                                     {"bursts of 8, 10", 8, 1e1, false},
                                     {"bursts of 8, 30", 8, 3e1, true},
                                     {"isolated, 1e3", 1, 1e3, true},
                                     {"bursts of 8, 1e3", 8, 1e3, false},
                                     {"bursts of 8, one side, 1e5", 8, 1e5, true},
                                     {"bursts of 8, one side, 1e9", 8, 1e9, true}};

training::TrainingData polluted(training::TrainingData data, const Pollution& p, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const Eigen::Index n = data.target.size();
  std::vector<bool> hit(static_cast<std::size_t>(n), false);
  for (Eigen::Index left = n / 10 / p.burst; left > 0; --left) {
    const auto first = static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(n - p.burst));
    for (Eigen::Index i = first; i < first + p.burst; ++i) hit[static_cast<std::size_t>(i)] = true;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!hit[static_cast<std::size_t>(i)]) continue;
    const double size = p.noises * kNoise_deg_per_h * (0.5 + static_cast<double>(random() % 1000) / 500);
    data.target[i] += p.one_side || random() % 2 ? size : -size;
  }
  return data;
}

}  // namespace

int outliers(std::uint64_t first_seed, int count) {
  constexpr Contender kRobust[] = {
      kContenders[0],
      kContenders[2],
      kContenders[3],
      {"leave-one-out", "ir-lssvm", training::Tuning::kLoo, compensation::Extrapolation::kPreset}};
  fmt::print(
      "| truth | outliers, noise | method | largest change, noise | improvement, % | without, % | within 2 sd_mean, % "
      "|\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Truth& truth : truths()) {
    for (const Contender& contender : kRobust) {
      for (const Pollution& p : kPollutions) {
        double largest = 0;
        std::vector<double> gain, without, inside;
        for (int s = 0; s < count; ++s) {
          const std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
          const Record cycle = simulate(simulation::paper_profile(), truth.settings, seed);
          const Record test = simulate(simulation::second_profile(), truth.settings, seed + 1);
          const Served good = serve(*trained(contender, cycle.data), test.data, contender.policy);
          const Served bad = serve(*trained(contender, polluted(cycle.data, p, seed)), test.data, contender.policy);
          largest = std::max(largest, (good.bias - bad.bias).cwiseAbs().maxCoeff() / kNoise_deg_per_h);
          const auto gained = [&](const Served& served) {
            const Eigen::VectorXd error = test.data.target - served.bias;
            return improvement(test.data.target.array() - test.data.target.mean(), error.array() - error.mean());
          };
          gain.push_back(gained(bad));
          without.push_back(gained(good));
          inside.push_back(covered(test.data.target - bad.bias, bad.sd_mean));
        }
        fmt::print("| {} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |\n", truth.name, p.name, contender.name,
                   largest, 100 * mean(gain), 100 * mean(without), 100 * mean(inside));
        std::fflush(stdout);
      }
    }
  }
  return 0;
}

}  // namespace prism::science
