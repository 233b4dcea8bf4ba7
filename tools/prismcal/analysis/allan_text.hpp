// SPDX-License-Identifier: MIT
// An Allan analysis of a recorded rate as text and as JSON.
#pragma once

#include <string>

#include "compensation/evaluation/allan.hpp"
#include "tools/prismcal/recordings/rate_series.hpp"

namespace prism::analysis {

std::string allan_text(const evaluation::AllanAnalysis& analysis, const recordings::RateSeries& series,
                       const std::string& where);
std::string allan_json(const evaluation::AllanAnalysis& analysis, const recordings::RateSeries& series,
                       const std::string& where);

}  // namespace prism::analysis
