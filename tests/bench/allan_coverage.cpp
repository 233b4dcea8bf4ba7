// SPDX-License-Identifier: MIT
// How often the intervals (68 %) and bounds (95 %) of Allan coefficients hold the truth, and how often a coefficient is
// given that the rate does not have: nine noises, with and without missing values.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "compensation/evaluation/allan.hpp"
#include "tests/support/power_law_noise.hpp"

namespace prism::bench {
namespace {

using namespace evaluation;

struct Truth {
  double q, s, b, k, slope;
};

/// Strengths for a series of n values: white noise of 1 per sample.
struct Kind {
  const char* name;
  Truth (*truth)(double n);
};

/// A walk that crosses the white noise at m.
double at(double m) { return 3 / (m * m); }

constexpr Kind kKinds[] = {{"white",
                            [](double) -> Truth {
                              return {0, 1, 0, 0, 0};
                            }},
                           {"white+walk",
                            [](double n) -> Truth {
                              return {0, 1, 0, at(n / 50), 0};
                            }},
                           {"white+flicker",
                            [](double n) -> Truth {
                              return {0, 1, 100 / n, 0, 0};
                            }},
                           {"white+flicker+walk",
                            [](double n) -> Truth {
                              return {0, 1, 200 / n, 3 * (200 / n) / (n / 10), 0};
                            }},
                           {"white+ramp",
                            [](double n) -> Truth {
                              return {0, 1, 0, 0, std::sqrt(2 / std::pow(n / 20, 3))};
                            }},
                           {"quantised",
                            [](double) -> Truth {
                              return {1.0 / 3, 1, 0, 0, 0};
                            }},
                           {"weak walk",
                            [](double n) -> Truth {
                              return {0, 1, 0, at(n / 15), 0};
                            }},
                           {"walk",
                            [](double) -> Truth {
                              return {0, 0, 0, 1, 0};
                            }},
                           {"weak flicker", [](double n) -> Truth {
                              return {0, 1, 30 / n, 0, 0};
                            }}};

std::vector<double> series(const Truth& truth, std::size_t n, const test::Flicker& flicker, test::NormalPairs& normal) {
  std::vector<double> rate(n);
  const auto add = [&](double strength, const std::vector<double>& part) {
    for (std::size_t i = 0; i < n; ++i) rate[i] += std::sqrt(strength) * part[i];
  };
  for (std::size_t i = 0; i < n; ++i) rate[i] = std::sqrt(truth.s) * normal() + truth.slope * static_cast<double>(i);
  if (truth.q > 0) add(truth.q, test::quantised_angle(n, normal));
  if (truth.b > 0) add(truth.b, flicker(normal));
  if (truth.k > 0) add(truth.k, test::averaged_walk(n, normal));
  return rate;
}

void remove_values(std::vector<double>& rate, const char* missing, test::NormalPairs& normal) {
  const std::size_t n = rate.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (*missing == 's' ? normal.uniform() < 0.01 : *missing == 'h' && i >= n * 45 / 100 && i < n * 55 / 100)
      rate[i] = std::nan("");
  }
}

void run(const Kind& kind, std::size_t n, int count, const char* missing) {
  const Truth truth = kind.truth(static_cast<double>(n));
  const test::Flicker flicker(truth.b > 0 ? n : 2);
  const double h = 3600, expected[] = {std::sqrt(truth.q), std::sqrt(truth.s / h), std::sqrt(truth.b / kFlicker),
                                       std::sqrt(truth.k * h), truth.slope * h};
  int given[kNoiseTypes] = {}, held[kNoiseTypes] = {}, bounded[kNoiseTypes] = {}, unexplained = 0;
  test::NormalPairs normal(n + static_cast<std::size_t>(&kind - kKinds));
  for (int i = 0; i < count; ++i) {
    std::vector<double> rate = series(truth, n, flicker, normal);
    remove_values(rate, missing, normal);
    const AllanAnalysis found = analyse_allan(std::move(rate), 1, "bench").value();
    unexplained += !found.unexplained_s.empty();
    for (std::size_t k = 0; k < kNoiseTypes; ++k) {
      const AllanCoefficient& c = (*found.coefficients)[k];
      given[k] += c.value.has_value();
      (c.value ? held : bounded)[k] += c.low <= expected[k] && expected[k] <= c.high;
    }
  }
  fmt::print("{:7} {:<19}", n, kind.name);
  const auto percent = [](int part, int all) { return all > 0 ? fmt::format("{:.0f} %", 100.0 * part / all) : "-"; };
  for (std::size_t k = 0; k < kNoiseTypes; ++k) {
    if (expected[k] > 0) {
      fmt::print(" {} given {}, holds {}, at most {};", "QNBKR"[k], percent(given[k], count),
                 percent(held[k], given[k]), percent(bounded[k], count - given[k]));
    } else if (given[k] > 0) {
      fmt::print(" {} false {:.1f} %;", "QNBKR"[k], 100.0 * given[k] / count);
    }
  }
  fmt::print(" unexplained {:.1f} %\n", 100.0 * unexplained / count);
  std::fflush(stdout);
}

}  // namespace
}  // namespace prism::bench

/// Arguments: series of each noise (300); missing values: none, singly (1 %) or hole (a tenth in the middle).
int main(int argc, char** argv) {
  for (const std::size_t n : {1000, 8000, 100000}) {
    for (const auto& kind : prism::bench::kKinds)
      prism::bench::run(kind, n, argc > 1 ? std::atoi(argv[1]) : 300, argc > 2 ? argv[2] : "none");
  }
}
