// SPDX-License-Identifier: MIT
// Results of Tao et al. 2019 for their gyro (tables 1 to 5), for comparison.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "tools/prismcal/analysis/experiment.hpp"

namespace prism::analysis {

/// One row of the paper's tables. c, sigma2 and F(x) are for normalised data of the paper's gyro.
struct PaperRow {
  std::optional<double> c, sigma2, cost_deg_per_h;
  double after_deg_per_h = 0;
  double improvement = 0;  ///< as a share
};

inline constexpr double kPaperBefore = 0.01850;  ///< deg/h, tables 2 and 3
inline constexpr std::array<double, 3> kPaperCorrelation = {0.71, -0.43,
                                                            -0.82};  ///< T, dT/dt, U with the bias, table 1

/// Returns the paper's row for a model with the same tuning, if there is one.
std::optional<PaperRow> paper_row(const ModelSpec& spec);

}  // namespace prism::analysis
