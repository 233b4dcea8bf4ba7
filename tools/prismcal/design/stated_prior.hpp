// SPDX-License-Identifier: MIT
// A gyro without a model or recordings: its bias as smooth in the inputs as a typical gyro's.
#pragma once

#include <vector>

#include "tools/prismcal/design/design_posterior.hpp"

namespace prism::design {

/// `bias_sd_deg_per_h`: spread of the bias over the domain, > 0; `noise_deg_per_h`: of the mean rate of a window of 100
/// s, > 0. Variances are those of the simulated gyros of docs/benchmarks.md, rounded; lengths are in standard
/// deviations of each range of the domain.
KnownGyro stated_gyro(const std::vector<InputRange>& domain, double bias_sd_deg_per_h, double noise_deg_per_h);

}  // namespace prism::design
