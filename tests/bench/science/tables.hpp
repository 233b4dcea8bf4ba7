// SPDX-License-Identifier: MIT
// The tables of docs/science.md, printed as Markdown.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/prismsim/simulation/simulated_gyro.hpp"

namespace prism::science {

struct Truth {
  const char* name;
  simulation::TruthSettings settings;
};
std::vector<Truth> truths();

/// Seeds first_seed, first_seed + 10, …: `count` gyros a truth. Returns the exit code, as real() does.
int simulated(std::uint64_t first_seed, int count);

/// Two further days of each of `count` gyros: is the improvement of the second within the interval of the first?
int intervals(std::uint64_t first_seed, int count);

/// `count` gyros with four siblings each: what four hours are worth alone and with them. Gyros of a type differ by 20 %
/// in scale and by a bend of 0.004 deg/h (1 sigma).
int siblings(std::uint64_t first_seed, int count);

/// The splits of a real chamber recording (three axes), by branches of its temperature and by thirds.
int real(const std::string& path);

}  // namespace prism::science
