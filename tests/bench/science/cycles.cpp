// SPDX-License-Identifier: MIT
// One, two and three cycles of a gyro, each after its own switch-on, and what three cycles could show at best.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr int kCycles = 3, kProfiles = 3;

/// One gyro's trainings: name in the table.
constexpr const char* kWays[] = {"1 cycle",      "2 cycles",          "3 cycles",
                                 "3, rows only", "3, nothing hidden", "thermal truth"};
enum Way { kOne, kTwo, kThree, kRowsOnly, kNothingHidden, kThermal, kWayCount };

/// Improvements on each profile, one per gyro.
struct Gains {
  std::vector<double> of[kProfiles][kWayCount], inside[kProfiles];
};

compensation::ModelPtr model_of(const std::vector<Record>& days, int count, Way way) {
  std::vector<training::TrainingData> cycles;
  for (int k = 0; k < count; ++k) {
    const Record& day = days[static_cast<std::size_t>(k)];
    cycles.push_back(day.data);
    if (way == kNothingHidden) cycles.back().target = day.repeating_deg_per_h;
  }
  return trained(kContenders.front(), joined(cycles, way == kRowsOnly));
}

void add_gyro(const Truth& truth, const simulation::ChamberProfile (&profiles)[kProfiles], std::uint64_t seed,
              Gains& gains) {
  std::vector<Record> days, tests;
  for (int k = 0; k < kCycles; ++k) days.push_back(simulate(simulation::paper_profile(), truth.settings, seed++));
  for (const auto& profile : profiles) tests.push_back(simulate(profile, truth.settings, seed++));
  constexpr std::pair<Way, int> kTrained[] = {
      {kOne, 1}, {kTwo, 2}, {kThree, kCycles}, {kRowsOnly, kCycles}, {kNothingHidden, kCycles}};
  for (const auto& [way, count] : kTrained) {
    const auto model = model_of(days, count, way);
    for (std::size_t p = 0; p < kProfiles; ++p) {
      const Served served = serve(*model, tests[p].data, kContenders.front().policy);
      gains.of[p][way].push_back(gained(tests[p].data, served.bias));
      if (way == kThree) gains.inside[p].push_back(covered(tests[p].data.target - served.bias, served.sd_mean));
    }
  }
  for (std::size_t p = 0; p < kProfiles; ++p)
    gains.of[p][kThermal].push_back(gained(tests[p].data, tests[p].thermal_deg_per_h));
}

}  // namespace

int cycles(std::uint64_t first_seed, int count) {
  fmt::print("| truth | profile |");
  for (const char* way : kWays) fmt::print(" {} |", way);
  fmt::print(" 3 cycles, within 2 sd_mean, % |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const simulation::ChamberProfile profiles[kProfiles] = {simulation::paper_profile(), simulation::second_profile(),
                                                          simulation::third_profile()};
  for (const Truth& truth : truths()) {
    Gains gains;
    for (int s = 0; s < count; ++s) add_gyro(truth, profiles, first_seed + 20 * static_cast<std::uint64_t>(s), gains);
    std::array<double, kWayCount> all{};  // mean over the profiles
    for (std::size_t p = 0; p < kProfiles; ++p) {
      fmt::print("| {} | {} |", truth.name, profiles[p].name);
      for (std::size_t w = 0; w < kWayCount; ++w) {
        all[w] += mean(gains.of[p][w]) / kProfiles;
        fmt::print(" {:.1f} |", 100 * mean(gains.of[p][w]));
      }
      fmt::print(" {:.1f} |\n", 100 * mean(gains.inside[p]));
    }
    std::fflush(stdout);
    if (!std::string_view(truth.name).starts_with("hard")) continue;
    const double more = all[kThree] - all[kOne], most = std::max(all[kNothingHidden], all[kThermal]) - all[kOne];
    bar(fmt::format("three cycles over one, {}", truth.name), fmt::format("{:+.1f} points", 100 * more),
        fmt::format("60 % of {:+.1f}, without hidden causes", 100 * most), more >= 0.6 * most);
  }
  return 0;
}

}  // namespace prism::science
