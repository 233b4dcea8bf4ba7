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

/// Names the averaging times that the five noises do not explain; empty if they explain all.
std::string unexplained_text(const evaluation::AllanAnalysis& analysis);

}  // namespace prism::analysis
