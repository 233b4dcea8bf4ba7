// SPDX-License-Identifier: MIT
// One passage through the temperatures: trained on a part of a cycle, evaluated on another whole day.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

/// Hours of the paper's cycle.
struct Part {
  const char* name;
  double begin_h, end_h;
  double required = 0;  ///< improvement, base truth
};
constexpr Part kParts[] = {{"a quarter of a cycle", 0, 6.42, 0.10},
                           {"heating and the hot plateau", 9, 20},
                           {"heating only", 9, 15, 0.20},
                           {"the heating ramp", 9, 13}};

training::TrainingData part_of(const training::TrainingData& data, const Part& part) {
  const auto row = [&](double hours) {
    return std::lower_bound(data.time_s.begin(), data.time_s.end(), 3600 * hours) - data.time_s.begin();
  };
  return rows(data, row(part.begin_h), row(part.end_h));
}

}  // namespace

int passes(std::uint64_t first_seed, int count) {
  fmt::print("| truth | trained on | composite (worst) |");
  for (std::size_t i = 1; i < kContenders.size(); ++i) fmt::print(" {} (worst) |", kContenders[i].name);
  fmt::print(" within 2 sd_mean, % |\n| --- | --- | --- | --- | --- | --- | --- |\n");
  double worst = 1;
  for (const Truth& truth : truths()) {
    for (const Part& part : kParts) {
      std::map<std::string, std::vector<double>> gain;
      std::vector<double> inside;
      for (int s = 0; s < count; ++s) {
        const std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
        const auto data = part_of(simulate(simulation::paper_profile(), truth.settings, seed).data, part);
        const Record test = simulate(simulation::paper_profile(), truth.settings, seed + 1);
        for (const Contender& contender : kContenders) {
          const compensation::ModelPtr model = trained(contender, data);
          if (contender.method != "composite") {
            gain[contender.name].push_back(gained(test.data, biases_of(*model, test.data)));
            continue;
          }
          const Served served = serve(*model, test.data, contender.policy);
          gain[contender.name].push_back(gained(test.data, served.bias));
          inside.push_back(covered(test.data.target - served.bias, served.sd_mean));
        }
      }
      fmt::print("| {} | {} |", truth.name, part.name);
      for (const Contender& contender : kContenders) {
        const auto& all = gain[contender.name];
        fmt::print(" {:.1f} ({:.1f}) |", 100 * mean(all), 100 * *std::min_element(all.begin(), all.end()));
      }
      fmt::print(" {:.1f} |\n", 100 * mean(inside));
      const auto& ours = gain[kContenders.front().name];
      const double least = *std::min_element(ours.begin(), ours.end());
      if (std::string_view(truth.name) == "base" && part.required > 0)
        bar(part.name, fmt::format("{:.1f} %", 100 * mean(ours)), fmt::format("{:.0f} %", 100 * part.required),
            mean(ours) >= part.required);
      worst = std::min(worst, least);
      std::fflush(stdout);
    }
  }
  bar("one passage, the worst gyro", fmt::format("{:.1f} %", 100 * worst), "-5 %", worst >= -0.05);
  return 0;
}

}  // namespace prism::science
