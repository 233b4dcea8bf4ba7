// SPDX-License-Identifier: MIT
// Outliers in a tenth of a cycle's blocks: by how much they change the predictions for another day.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>

#include "compensation/training/robust.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr double kNoise_deg_per_h = 0.0064;  // of a block's mean
constexpr double kGross = 1e3;               // noises

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

struct Case {
  std::uint64_t seed;
  Record cycle, test;
  Served good;                                             ///< without outliers
  std::map<std::vector<Eigen::Index>, Served> known = {};  ///< by the gross outliers, which training leaves out

  /// Gross outliers of any size in the same rows leave the same rows: these are trained once.
  Served with(const Pollution& p, const Contender& contender) {
    const training::TrainingData data = polluted(cycle.data, p, seed);
    std::vector<Eigen::Index> far;
    if (p.noises >= kGross) far = training::gross_outliers(data.inputs, data.target, training::runs_of(data));
    if (const auto found = known.find(far); found != known.end() && !far.empty()) return found->second;
    return known[far] = serve(*trained(contender, data), test.data, contender.policy);
  }
};

Case case_of(const Truth& truth, const Contender& contender, std::uint64_t seed) {
  Case c{seed,
         simulate(simulation::paper_profile(), truth.settings, seed),
         simulate(simulation::second_profile(), truth.settings, seed + 1),
         {}};
  c.good = serve(*trained(contender, c.cycle.data), c.test.data, contender.policy);
  return c;
}

}  // namespace

int outliers(std::uint64_t first_seed, int count) {
  constexpr Contender kRobust[] = {
      kContenders[0],
      kContenders[2],
      kContenders[3],
      {"leave-one-out", "ir-lssvm", training::Tuning::kLoo, compensation::Extrapolation::kPreset}};
  std::map<std::string, double> most;
  std::map<std::string, std::vector<double>> held;  // by outliers, all truths
  fmt::print(
      "| truth | outliers, noise | method | largest change, noise | improvement, % | without, % | within 2 sd_mean, % "
      "|\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Truth& truth : truths()) {
    for (const Contender& contender : kRobust) {
      std::vector<Case> cases;
      for (int s = 0; s < count; ++s)
        cases.push_back(case_of(truth, contender, first_seed + 10 * static_cast<std::uint64_t>(s)));
      for (const Pollution& p : kPollutions) {
        double largest = 0;
        std::vector<double> gain, without, inside;
        for (Case& c : cases) {
          const Served bad = c.with(p, contender);
          largest = std::max(largest, (c.good.bias - bad.bias).cwiseAbs().maxCoeff() / kNoise_deg_per_h);
          gain.push_back(gained(c.test.data, bad.bias));
          without.push_back(gained(c.test.data, c.good.bias));
          inside.push_back(covered(c.test.data.target - bad.bias, bad.sd_mean));
        }
        fmt::print("| {} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |\n", truth.name, p.name, contender.name,
                   largest, 100 * mean(gain), 100 * mean(without), 100 * mean(inside));
        std::fflush(stdout);
        if (p.noises >= kGross) most[contender.name] = std::max(most[contender.name], largest);
        if (contender.method == "composite") held[p.name].push_back(mean(inside));
      }
    }
  }
  for (const auto& [name, largest] : most)
    bar(fmt::format("gross outliers, {}", name), fmt::format("largest change {:.2f} noise", largest), "3", largest < 3);
  double low = 1, high = 0;
  for (const auto& [name, shares] : held) {
    low = std::min(low, mean(shares));
    high = std::max(high, mean(shares));
  }
  bar("outliers of each type, within 2 sd_mean of the composite kernel",
      fmt::format("{:.1f} to {:.1f} %", 100 * low, 100 * high), "93 to 98.5 %", low >= 0.93 && high <= 0.985);
  return 0;
}

}  // namespace prism::science
