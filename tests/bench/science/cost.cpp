// SPDX-License-Identifier: MIT
// CPU time of the composite training.
#include <fmt/format.h>

#include <ctime>
#include <string>
#include <vector>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

struct Size {
  Eigen::Index rows;
  double most_s;  ///< required
};
constexpr Size kSizes[] = {{924, 10}, {100000, 120}};

}  // namespace

int cost(std::uint64_t first_seed, int count) {
  fmt::print("| rows | CPU, s |\n| --- | --- |\n");
  for (const Size& size : kSizes) {
    std::vector<double> seconds;
    for (int s = 0; s < count; ++s) {
      std::uint64_t seed = first_seed + 1000 * static_cast<std::uint64_t>(s);
      std::vector<training::TrainingData> cycles;
      for (Eigen::Index rows = 0; rows < size.rows; rows += cycles.back().target.size())
        cycles.push_back(simulate(simulation::paper_profile(), simulation::BiasModelSettings::hard(), seed++).data);
      const training::TrainingData all = joined(cycles, true);
      const std::clock_t begin = std::clock();
      fitted(kContenders.front(), all);
      seconds.push_back(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    fmt::print("| {} | {:.1f} |\n", size.rows, mean(seconds));
    bar(fmt::format("training of {} rows", size.rows), fmt::format("{:.1f} s of CPU", mean(seconds)),
        fmt::format("{:.0f} s", size.most_s), mean(seconds) <= size.most_s);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace prism::science
