// SPDX-License-Identifier: MIT
// Four hours of a gyro, alone and with the models of four gyros of its type.
#include <fmt/format.h>

#include <cstdio>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr int kSiblings = 4;
constexpr Eigen::Index kShort = 4 * 36;  // blocks of 100 s

struct Tally {
  std::vector<double> gain, held;

  void judge(const compensation::Model& model, const Record& test) {
    const Served served = serve(model, test.data, compensation::Extrapolation::kPreset);
    const Eigen::VectorXd error = test.data.target - served.bias;
    gain.push_back(gained(test.data, served.bias));
    held.push_back(covered(error, served.sd_mean));
  }
};

}  // namespace

int siblings(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | profile | 4 h alone | covered, % | with a prior of {} gyros | covered, % | complete cycle | "
      "explained, % |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- |\n",
      kSiblings);
  for (const Truth& truth : truths()) {
    const simulation::ChamberProfile profiles[] = {simulation::paper_profile(), simulation::second_profile()};
    Tally alone[2], together[2], whole[2];
    std::vector<double> explained;
    for (int s = 0; s < count; ++s) {
      std::uint64_t seed = first_seed + 20 * static_cast<std::uint64_t>(s);
      std::vector<compensation::ModelPtr> family;
      for (int i = 1; i <= kSiblings; ++i, ++seed)
        family.push_back(trained(kContenders.front(), simulate(profiles[0], truth.settings, seed, seed).data));
      const std::uint64_t own = seed;
      const training::TrainingData cycle = simulate(profiles[0], truth.settings, ++seed, own).data;
      const training::TrainingData part = rows(cycle, 0, kShort);
      const training::TrainedModel with = fitted(kContenders.front(), part, family);
      const auto without = trained(kContenders.front(), part), all = trained(kContenders.front(), cycle);
      explained.push_back(with.from_siblings.value_or(kUnknown));
      for (int p = 0; p < 2; ++p) {
        const Record test = simulate(profiles[p], truth.settings, ++seed, own);
        alone[p].judge(*without, test);
        together[p].judge(*with.model, test);
        whole[p].judge(*all, test);
      }
    }
    for (int p = 0; p < 2; ++p) {
      fmt::print("| {} | {} | {:.1f} | {:.0f} | {:.1f} | {:.0f} | {:.1f} | {:.0f} |\n", truth.name, profiles[p].name,
                 100 * mean(alone[p].gain), 100 * mean(alone[p].held), 100 * mean(together[p].gain),
                 100 * mean(together[p].held), 100 * mean(whole[p].gain), 100 * mean(explained));
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace prism::science
