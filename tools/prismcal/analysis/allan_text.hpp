// SPDX-License-Identifier: MIT
// An Allan analysis as readable text and as JSON.
#pragma once

#include <string>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "tools/prismcal/recordings/rate_series.hpp"

namespace prism::analysis {

struct AllanAnalysis {
  evaluation::AllanCurve curve;                        ///< of the grid that was asked for
  std::vector<evaluation::AllanInterval> intervals;    ///< of `curve`
  Result<evaluation::AllanCoefficients> coefficients;  ///< always from the octave points, or the error
  double probability = 0.683;
};

Result<AllanAnalysis> analyse_allan(const recordings::RateSeries& series, evaluation::AllanGrid grid,
                                    evaluation::AllanEstimator estimator, double probability, const std::string& where);

std::string allan_text(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where);
std::string allan_json(const AllanAnalysis& analysis, const recordings::RateSeries& series, const std::string& where);

}  // namespace prism::analysis
