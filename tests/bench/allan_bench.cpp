// SPDX-License-Identifier: MIT
// Time of the Allan analysis of a long record, relative to a lower bound from the same run: one running sum of the
// record per averaging time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <vector>

#include "compensation/evaluation/allan.hpp"

namespace prism::bench {
namespace {

constexpr std::size_t kValues = 10'000'000;

double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

template <class Job>
double best_s(Job&& job) {
  double best = 1e300;
  for (int round = 0; round < 3; ++round) {
    const double begin = cpu_s();
    job();
    best = std::min(best, cpu_s() - begin);
  }
  return best;
}

volatile double sink;

int run() {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> rate(kValues), sum(kValues);
  for (double& value : rate) value = normal(random);
  fmt::print("Allan analysis, {} values (target: under 5 s)\n", kValues);
  const double floor = best_s([&] {
    for (std::size_t m = 1; m <= kValues / 8; m *= 2) {
      double total = 0;
      for (std::size_t k = 0; k < kValues; ++k) sum[k] = total += rate[k];
      sink = sum.back();
    }
  });
  double shortest = 0;
  const double took = best_s([&] { shortest = evaluation::analyse_allan(rate, 1, "bench")->points.front().deviation; });
  // White noise of sd 1: the deviation at one value is 1 within 1/sqrt(values).
  if (std::fabs(shortest - 1) > 2e-3)
    return fmt::print("found an Allan deviation of {}, expected 1 (white noise of sd 1)\n", shortest), 1;
  fmt::print("  {:6.3f} CPU s; running sums {:6.3f} CPU s; ratio {:.2f}\n", took, floor, took / floor);
  return 0;
}

}  // namespace
}  // namespace prism::bench

int main() { return prism::bench::run(); }
