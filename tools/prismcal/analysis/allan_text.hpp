// SPDX-License-Identifier: MIT
// Runs an Allan analysis and prints it as text and as JSON.
#pragma once

#include <string>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "tools/prismcal/recordings/rate_series.hpp"

namespace prism::analysis {

struct AllanAnalysis {
  evaluation::AllanCurve curve;                        ///< at the averaging times of the requested grid
  std::vector<evaluation::AllanInterval> intervals;    ///< confidence intervals of `curve`
  Result<evaluation::AllanCoefficients> coefficients;  ///< always from octave points; or an error
  double probability = 0.683;                          ///< of the intervals
};

/// Errors: those of allan_deviation(); a rate that does not vary.
Result<AllanAnalysis> analyse_allan(const recordings::RateSeries& series, evaluation::AllanGrid grid,
                                    evaluation::AllanEstimator estimator, double probability, const std::string& where);

std::string allan_text(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where);
std::string allan_json(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where);

}  // namespace prism::analysis
