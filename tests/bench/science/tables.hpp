// SPDX-License-Identifier: MIT
// The tables of docs/benchmarks.md, printed as Markdown.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::science {

struct Truth {
  const char* name;
  simulation::BiasModelSettings settings;
};
std::vector<Truth> truths();

/// Prints a requirement of the model and whether it is met: "bar: NAME: found FOUND, required REQUIRED: met" or
/// "MISSED".
void bar(const std::string& name, const std::string& found, const std::string& required, bool met);

/// `count` gyros per truth, with the seeds first_seed, first_seed + 10, … All functions return the exit code.
int simulated(std::uint64_t first_seed, int count);

/// Two further days of each of `count` gyros: is the improvement of the second within the interval of the first?
int intervals(std::uint64_t first_seed, int count);

/// `count` gyros with four gyros of their type each: the result of four hours alone and with the population prior.
/// Gyros of a type differ by 20 % in scale and by a curvature of 0.004 deg/h (1 sigma).
int siblings(std::uint64_t first_seed, int count);

/// Parts of a cycle with one passage through the temperatures; tested on another day.
int passes(std::uint64_t first_seed, int count);

/// Outliers in a tenth of the blocks: the largest change of a prediction, and what is left of the improvement.
int outliers(std::uint64_t first_seed, int count);

/// One to three cycles of each gyro, each with its own switch-on.
int cycles(std::uint64_t first_seed, int count);

/// Eight hours of a designed profile, of simple ones, and the paper's cycle: judged on the third profile.
int designs(std::uint64_t first_seed, int count);

/// CPU time of the composite training: a cycle, and 100 000 rows.
int cost(std::uint64_t first_seed, int count);

/// Thermometers in the chamber's air and in the gyro: the time constant that training finds, and what it gains.
int lag(std::uint64_t first_seed, int count);

/// Switch-ons of gyros at rest, `count` models per truth: how many raise the problem that the corrected rate is not the
/// Earth rate, with good models and with a bias that moved by 0.1 deg/h; and gyros that are not at rest.
int rest(std::uint64_t first_seed, int count);

/// The monitor of a model in 200 quiet years of `count` gyros, of residuals with a known correlation and of each truth:
/// false alarms, and when shifts and ageing are found.
int monitor(std::uint64_t first_seed, int count);

/// The splits of a real chamber recording (three axes), by heating and cooling and by thirds.
int real(const std::string& path);

}  // namespace prism::science
