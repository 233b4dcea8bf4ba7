// SPDX-License-Identifier: MIT
// How often the printed prediction interval of an improvement contains the improvement of the next recording.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "compensation/evaluation/improvement_interval.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

struct Day {
  std::vector<double> before, after;
};

Day day_of(const compensation::Model& model, const Record& record) {
  const Eigen::VectorXd after =
      record.data.target - serve(model, record.data, compensation::Extrapolation::kPreset).bias;
  return {{record.data.target.begin(), record.data.target.end()}, {after.begin(), after.end()}};
}

evaluation::Estimate interval_of(const Day& day) {
  const auto interval = evaluation::next_improvement(day.before, day.after);
  if (!interval) {
    fmt::print(stderr, "bench_science: found no interval of the improvement\n");
    std::exit(1);
  }
  return *interval;
}

double improvement_of(const Day& day) {
  using evaluation::Divisor;
  return *evaluation::measure_bias_stability(day.before, day.after, {}, Divisor::kN).improvement;
}

struct Tally {
  std::vector<double> held, width, block, far;
};

}  // namespace

int intervals(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | profile | method | covered, % of {} | half width, points | sd of next minus this | block, 100 s |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n",
      count);
  for (const Truth& truth : truths()) {
    const simulation::ChamberProfile profiles[] = {simulation::paper_profile(), simulation::second_profile()};
    for (const Contender& contender : {kContenders[1], kContenders[0]}) {
      Tally tallies[2];
      for (int s = 0; s < count; ++s) {
        std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
        const compensation::ModelPtr model =
            trained(contender, simulate(simulation::paper_profile(), truth.settings, seed).data);
        for (std::size_t p = 0; p < 2; ++p) {
          const Day day = day_of(*model, simulate(profiles[p], truth.settings, ++seed));
          const auto here = interval_of(day);
          const double next = improvement_of(day_of(*model, simulate(profiles[p], truth.settings, ++seed)));
          tallies[p].held.push_back(next >= here.low && next <= here.high);
          tallies[p].width.push_back((here.high - here.low) / 2);
          tallies[p].far.push_back((next - here.value) * (next - here.value));
          tallies[p].block.push_back(static_cast<double>(evaluation::bootstrap_block(day.after)));
        }
      }
      for (std::size_t p = 0; p < 2; ++p) {
        fmt::print("| {} | {} | {} | {:.0f} | {:.1f} | {:.1f} | {:.0f} |\n", truth.name, profiles[p].name,
                   contender.name, 100 * mean(tallies[p].held), 100 * mean(tallies[p].width),
                   100 * std::sqrt(mean(tallies[p].far)), mean(tallies[p].block));
      }
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace prism::science
