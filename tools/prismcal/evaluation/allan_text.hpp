// SPDX-License-Identifier: MIT
// An Allan analysis as text for people and as JSON.
#pragma once

#include <string>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "tools/prismcal/evaluation/rate_series.hpp"

namespace prism {

struct AllanAnalysis {
  AllanCurve curve;                        ///< of the grid that was asked for
  std::vector<AllanInterval> intervals;    ///< of `curve`
  Result<AllanCoefficients> coefficients;  ///< always from the octave points; the refusal says why there are none
  double probability = 0.683;
};

Result<AllanAnalysis> analyse_allan(const RateSeries& series, AllanGrid grid, AllanEstimator estimator,
                                    double probability, const std::string& where);

std::string allan_text(const AllanAnalysis& analysis, const RateSeries& series, const std::string& where);
std::string allan_json(const AllanAnalysis& analysis, const RateSeries& series, const std::string& where);

}  // namespace prism
