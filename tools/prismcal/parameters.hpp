// SPDX-License-Identifier: MIT
// The parameters of a gyro in the terms of IEEE Std 647 and 952, in one table.
#pragma once

#include <optional>
#include <vector>

#include "tools/prismcal/recording_report.hpp"

namespace prism::analysis {

/// From all recordings of an evaluation together, before and after the correction. `warm_up_band_deg_per_h`: nullopt:
/// the white noise of a block, rounded up to one digit.
report::Table parameters_table(const std::vector<EvaluatedRecording>& recordings,
                               std::optional<double> warm_up_band_deg_per_h);

/// Those of the noises alone, of a rate without a correction.
report::Table noise_parameters_table(const evaluation::AllanAnalysis& analysis);

}  // namespace prism::analysis
