// SPDX-License-Identifier: MIT
// An Allan analysis of a recorded rate as a report and as JSON.
#pragma once

#include <string>

#include "compensation/evaluation/allan.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/rate_series.hpp"

namespace prism::analysis {

/// Without cover and facts.
report::Report allan_report(const evaluation::AllanAnalysis& analysis, const Result<evaluation::Spectrum>& spectrum,
                            const recordings::RateSeries& series, const std::string& where);
std::string allan_json(const evaluation::AllanAnalysis& analysis, const recordings::RateSeries& series,
                       const std::string& where);

}  // namespace prism::analysis
