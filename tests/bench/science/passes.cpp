// SPDX-License-Identifier: MIT
// One passage through the temperatures: trained on a part of a cycle, evaluated on another whole day.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

/// Hours of the paper's cycle.
struct Part {
  const char* name;
  double begin_h, end_h;
};
constexpr Part kParts[] = {{"a quarter of a cycle", 0, 6.42},
                           {"heating and the hot plateau", 9, 20},
                           {"heating only", 9, 15},
                           {"the heating ramp", 9, 13}};

training::TrainingData part_of(const training::TrainingData& data, const Part& part) {
  const auto row = [&](double hours) {
    return std::lower_bound(data.time_s.begin(), data.time_s.end(), 3600 * hours) - data.time_s.begin();
  };
  return rows(data, row(part.begin_h), row(part.end_h));
}

Eigen::VectorXd about_mean(const Eigen::VectorXd& v) { return v.array() - v.mean(); }

}  // namespace

int passes(std::uint64_t first_seed, int count) {
  fmt::print("| truth | trained on | composite (worst) |");
  for (std::size_t i = 1; i < kContenders.size(); ++i) fmt::print(" {} (worst) |", kContenders[i].name);
  fmt::print(" within 2 sd_mean, % |\n| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Truth& truth : truths()) {
    for (const Part& part : kParts) {
      std::map<std::string, std::vector<double>> gain;
      std::vector<double> inside;
      for (int s = 0; s < count; ++s) {
        const std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
        const auto data = part_of(simulate(simulation::paper_profile(), truth.settings, seed).data, part);
        const Record test = simulate(simulation::paper_profile(), truth.settings, seed + 1);
        for (const Contender& contender : kContenders) {
          const Served served = serve(*trained(contender, data), test.data, contender.policy);
          const Eigen::VectorXd error = test.data.target - served.bias;
          gain[contender.name].push_back(improvement(about_mean(test.data.target), about_mean(error)));
          if (contender.method == "composite") inside.push_back(covered(error, served.sd_mean));
        }
      }
      fmt::print("| {} | {} |", truth.name, part.name);
      for (const Contender& contender : kContenders) {
        const auto& all = gain[contender.name];
        fmt::print(" {:.1f} ({:.1f}) |", 100 * mean(all), 100 * *std::min_element(all.begin(), all.end()));
      }
      fmt::print(" {:.1f} |\n", 100 * mean(inside));
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace prism::science
