// SPDX-License-Identifier: MIT
// A thermometer outside the gyro: trained on one cycle, tested on another day, by the time constant of its response.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <future>

#include "compensation/training/response.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

struct Tested {
  double gain = 0, covered = 0;
};

/// The points that one gyro, or all of them, lost to the best fixed time constant.
struct Losses {
  std::vector<double> lost, inside, without_uhfo;
  double search_s = 0, training_s = 0, covered = 0;
  int trainings = 0, cases = 0;
  std::string lines;  ///< of the table

  void add(const Losses& other) {
    for (const auto list : {&Losses::lost, &Losses::inside, &Losses::without_uhfo})
      (this->*list).insert((this->*list).end(), (other.*list).begin(), (other.*list).end());
    search_s += other.search_s, training_s += other.training_s, covered += other.covered;
    trainings += other.trainings, cases += other.cases;
  }
};

/// Of this thread.
double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Its blocks with T and dTdt, and with U if `uhfo`.
training::TrainingData blocks(const Cycle& cycle, int tau_s, bool uhfo) {
  training::TrainingData data = cycle.blocks(tau_s);
  if (uhfo) return data;
  data.names.pop_back();
  data.inputs.conservativeResize(2, Eigen::NoChange);
  return data;
}

Tested tested(const training::TrainingData& cycle, const training::TrainingData& test, Losses& losses) {
  const Contender& ours = kContenders.front();
  const double begin_s = cpu_s();
  const compensation::ModelPtr model = trained(ours, cycle);
  losses.training_s += cpu_s() - begin_s;
  ++losses.trainings;
  const Served served = serve(*model, test, ours.policy);
  return {gained(test, served.bias), covered(test.target - served.bias, served.sd_mean)};
}

/// One row of the table: a gyro with U if `uhfo`; body_s 0: with the thermometer in its body.
void run(const Truth& truth, bool uhfo, int body_s, std::uint64_t seed, Losses& losses) {
  simulation::BiasModelSettings settings = truth.settings;
  settings.thermometer_in_air = body_s > 0;
  if (body_s > 0) settings.axis.body_lag_s = body_s;
  const Cycle cycle = simulate_cycle(simulation::paper_profile(), settings, seed);
  const Cycle day = simulate_cycle(simulation::paper_profile(), settings, seed + 1);
  const training::TrainingData measured = blocks(cycle, 0, uhfo);
  const double begin_s = cpu_s();
  const training::ResponseSearch found =
      training::find_response(measured, {}, 100).value_or(training::ResponseSearch{});
  losses.search_s += cpu_s() - begin_s;
  const auto test = [&](int tau_s) { return tested(blocks(cycle, tau_s, uhfo), blocks(day, tau_s, uhfo), losses); };
  const Tested ours = test(found.tau_s), none = found.tau_s > 0 ? test(0) : ours;
  double best = std::max(none.gain, ours.gain);
  int best_s = none.gain >= ours.gain ? 0 : found.tau_s;
  for (const int percent : uhfo ? std::vector{50, 75, 100, 150} : std::vector{100}) {
    const int tau_s = body_s * percent / 100;
    if (tau_s == 0) continue;
    if (const double gain = test(tau_s).gain; gain > best) best = gain, best_s = tau_s;
  }
  (body_s == 0 ? losses.inside : uhfo ? losses.lost : losses.without_uhfo).push_back(best - ours.gain);
  losses.covered += ours.covered;
  ++losses.cases;
  losses.lines += fmt::format(
      "| {} | {} | {} | {} | {} | {} ({:.0f} to {:.0f}) | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {} | {:.1f} |\n",
      truth.name, uhfo ? "T, dTdt, U" : "T, dTdt", body_s > 0 ? "air" : "body", body_s, seed, found.tau_s, found.low_s,
      found.high_s, found.gain, 100 * ours.gain, 100 * none.gain, 100 * best, best_s, 100 * ours.covered);
}

}  // namespace

int lag(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | inputs | thermometer | body, s | seed | found, s (95 %) | gain | improvement | as measured | best "
      "fixed | its "
      "s "
      "| within 2 sd_mean |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  Losses all;
  for (const Truth& truth : truths()) {
    if (truth.settings.smooth) continue;
    std::vector<std::future<Losses>> gyros;
    for (int s = 0; s < count; ++s) {
      gyros.push_back(std::async(std::launch::async, [&truth, seed = first_seed + 10 * static_cast<std::uint64_t>(s)] {
        Losses gyro;
        for (const int body_s : {0, 300, 900, 1800, 3900, 7200}) run(truth, true, body_s, seed, gyro);
        for (const int body_s : {0, 1800, 7200}) run(truth, false, body_s, seed, gyro);
        return gyro;
      }));
    }
    for (auto& gyro : gyros) {
      const Losses one = gyro.get();
      fmt::print("{}", one.lines);
      std::fflush(stdout);
      all.add(one);
    }
  }
  const auto worst = [](const std::vector<double>& losses) { return *std::max_element(losses.begin(), losses.end()); };
  const double within = all.covered / all.cases,
               ratio = 1 + all.search_s / all.cases / (all.training_s / all.trainings);
  bar("lost to the best fixed time constant, mean", fmt::format("{:.2f} points", 100 * mean(all.lost)), "at most 1.5",
      mean(all.lost) <= 0.015);
  bar("the same, the worst", fmt::format("{:.1f} points", 100 * worst(all.lost)), "at most 6", worst(all.lost) <= 0.06);
  bar("the same without U, mean", fmt::format("{:.2f} points", 100 * mean(all.without_uhfo)), "at most 1.5",
      mean(all.without_uhfo) <= 0.015);
  bar("lost with the thermometer in the body, the worst", fmt::format("{:.1f} points", 100 * worst(all.inside)),
      "at most 1", worst(all.inside) <= 0.01);
  bar("blocks within 2 sd_mean", fmt::format("{:.1f} %", 100 * within), "92 to 98 %", within >= 0.92 && within <= 0.98);
  bar("processor time of search and training to that of training", fmt::format("{:.2f}", ratio), "at most 3",
      ratio <= 3);
  return 0;
}

}  // namespace prism::science
