// SPDX-License-Identifier: MIT
// Truths × profiles × methods: each method trained on one paper cycle, evaluated on other cycles.
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <ctime>
#include <map>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

std::vector<simulation::ChamberProfile> profiles() {
  return {simulation::paper_profile(),  simulation::second_profile(), simulation::third_profile(),
          simulation::beyond_profile(), simulation::fast_profile(),   simulation::steady_profile()};
}

/// One truth on one profile; one number per seed.
struct Cell {
  std::map<std::string, std::vector<double>> improvement;       // by method
  std::vector<double> covered, truth_covered, flagged, caught;  // of the composite kernel
};

Eigen::VectorXd centred(const Eigen::VectorXd& v) { return v.array() - v.mean(); }

// Large: above three times the standard deviation of the residual of the repeat run.
void judge_guard(const Eigen::VectorXd& error, const Served& served, double repeat_sd, Cell& cell) {
  double flags = 0, large = 0, caught = 0;
  for (Eigen::Index k = 0; k < error.size(); ++k) {
    const bool flag = served.flagged[static_cast<std::size_t>(k)], far = std::abs(error[k]) > 3 * repeat_sd;
    flags += flag;
    large += far;
    caught += flag && far;
  }
  cell.flagged.push_back(flags / static_cast<double>(error.size()));
  if (large > 0) cell.caught.push_back(caught / large);
}

void judge(const Contender& contender, const compensation::Model& model, const Record& test, double& repeat_sd,
           Cell& cell) {
  std::vector<double>& improvement = cell.improvement[contender.name];
  if (contender.method != "composite") {
    improvement.push_back(gained(test.data, biases_of(model, test.data)));
    return;
  }
  const Served served = serve(model, test.data, contender.policy);
  const Eigen::VectorXd error = test.data.target - served.bias;
  improvement.push_back(gained(test.data, served.bias));
  if (std::isnan(repeat_sd)) repeat_sd = std::sqrt(centred(error).squaredNorm() / static_cast<double>(error.size()));
  cell.covered.push_back(covered(error, served.sd_mean));
  const Eigen::Index rest = error.size() - 1;  // the truth of the first block is incomplete
  const Eigen::VectorXd off =
      Eigen::Map<const Eigen::VectorXd>(test.true_bias_deg_per_h.data(), error.size()) - served.bias;
  cell.truth_covered.push_back(covered(off.tail(rest), served.sd.tail(rest)));
  judge_guard(error, served, repeat_sd, cell);
}

// The mean paired difference to the rival with the best mean, and its 95 % interval by Student's t.
std::string against_best(const Cell& cell) {
  const auto& ours = cell.improvement.at(kContenders.front().name);
  const auto best = std::max_element(kContenders.begin() + 1, kContenders.end(), [&](const auto& a, const auto& b) {
    return mean(cell.improvement.at(a.name)) < mean(cell.improvement.at(b.name));
  });
  std::vector<double> difference = cell.improvement.at(best->name);
  std::transform(ours.begin(), ours.end(), difference.begin(), difference.begin(), std::minus<>());
  const double centre = mean(difference), n = static_cast<double>(difference.size());
  if (n < 2) return fmt::format("{:+.1f} to {}", 100 * centre, best->name);
  double squares = 0;
  for (const double d : difference) squares += (d - centre) * (d - centre);
  const double quantile = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  return fmt::format("{:+.1f} ± {:.1f} to {}", 100 * centre, 100 * quantile * std::sqrt(squares / (n - 1) / n),
                     best->name);
}

void print_row(const char* truth, const std::string& profile, const Cell& cell) {
  const auto& ours = cell.improvement.at(kContenders.front().name);
  fmt::print("| {} | {} | {:.1f} ({:.1f}) |", truth, profile, 100 * mean(ours),
             100 * *std::min_element(ours.begin(), ours.end()));
  for (std::size_t i = 1; i < kContenders.size(); ++i)
    fmt::print(" {:.1f} |", 100 * mean(cell.improvement.at(kContenders[i].name)));
  fmt::print(" {} | {:.1f} | {:.1f} | {:.1f} | {:.0f} |\n", against_best(cell), 100 * mean(cell.covered),
             100 * mean(cell.truth_covered), 100 * mean(cell.flagged), 100 * mean(cell.caught));
}

void print_bars(const std::vector<Cell>& cells) {
  double all = 0;
  long held = 0, gains = 0;
  for (const Cell& cell : cells) {
    const double share = mean(cell.covered);
    all += share / static_cast<double>(cells.size());
    held += share >= 0.90 && share <= 0.985;
    gains += mean(cell.improvement.at(kContenders.front().name)) > 0;
  }
  const auto count = static_cast<long>(cells.size());
  bar("cells with 90 to 98.5 % of the blocks within 2 sd_mean", fmt::format("{}", held), fmt::format("{}", count),
      held == count);
  bar("blocks within 2 sd_mean, all cells", fmt::format("{:.1f} %", 100 * all), "93 to 97 %",
      all >= 0.93 && all <= 0.97);
  bar("cells better than no correction", fmt::format("{}", gains), fmt::format("{}", count), gains == count);
}

}  // namespace

void bar(const std::string& name, const std::string& found, const std::string& required, bool met) {
  fmt::print("bar: {}: found {}, required {}: {}\n", name, found, required, met ? "met" : "MISSED");
}

std::vector<Truth> truths() {
  simulation::BiasModelSettings hard = simulation::BiasModelSettings::hard(), smooth, hard_smooth = hard;
  smooth.smooth = hard_smooth.smooth = true;
  return {{"base", {}}, {"hard", hard}, {"smooth", smooth}, {"hard smooth", hard_smooth}};
}

int simulated(std::uint64_t first_seed, int count) {
  fmt::print("| truth | profile | composite (worst) |");
  for (std::size_t i = 1; i < kContenders.size(); ++i) fmt::print(" {} |", kContenders[i].name);
  fmt::print(
      " against the best | within 2 sd_mean, % | truth within 2 sd, % | flagged, % | large errors flagged, % |\n");
  fmt::print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  std::vector<Cell> judged;  // inside the range of the training
  for (const Truth& truth : truths()) {
    std::vector<Cell> cells(profiles().size());
    std::clock_t training = 0;
    for (int s = 0; s < count; ++s) {
      // A different gyro for each seed, and a different day for each profile.
      std::uint64_t seed = first_seed + 10 * static_cast<std::uint64_t>(s);
      const Record cycle = simulate(simulation::paper_profile(), truth.settings, seed);
      std::vector<Record> tests;
      for (const simulation::ChamberProfile& profile : profiles())
        tests.push_back(simulate(profile, truth.settings, ++seed));
      for (const Contender& contender : kContenders) {
        const std::clock_t begin = std::clock();
        const compensation::ModelPtr model = trained(contender, cycle.data);
        if (contender.method == "composite") training += std::clock() - begin;
        double repeat_sd = kUnknown;
        for (std::size_t i = 0; i < tests.size(); ++i) judge(contender, *model, tests[i], repeat_sd, cells[i]);
      }
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      print_row(truth.name, profiles()[i].name, cells[i]);
      if (profiles()[i].name != simulation::beyond_profile().name) judged.push_back(cells[i]);
    }
    fmt::print("<!-- {}: training {:.1f} s of CPU each -->\n", truth.name,
               static_cast<double>(training) / CLOCKS_PER_SEC / count);
    std::fflush(stdout);
  }
  print_bars(judged);
  return 0;
}

}  // namespace prism::science
