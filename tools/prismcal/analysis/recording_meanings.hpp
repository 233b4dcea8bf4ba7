// SPDX-License-Identifier: MIT
// Conclusions for this gyro from the values of a table or figure: one sentence each, computed from them.
#pragma once

#include <string>
#include <vector>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/bias_stability.hpp"
#include "compensation/evaluation/correlation.hpp"
#include "compensation/evaluation/hysteresis.hpp"
#include "compensation/evaluation/thermal_segments.hpp"
#include "tools/prismcal/recordings/block_table.hpp"

namespace prism::analysis {

/// How far the temperature, its slope and the bias went.
std::string record_meaning(const recordings::BlockTable& table);

/// Is white noise all that is left, or could a better model remove more?
std::string stability_meaning(const evaluation::BiasStability& stability, bool doubtful = false);

/// The largest deviation that the model leaves. One value per block; corrected values may be unknown.
std::string bias_meaning(const recordings::BlockTable& table, const std::vector<double>& corrected_deg_per_h);

/// Is the correction as good while the temperature changes as in soaks? One value per block.
std::string segments_meaning(const std::vector<evaluation::ThermalKind>& kinds,
                             const std::vector<double>& bias_deg_per_h, const std::vector<double>& corrected_deg_per_h,
                             double extrapolated_percent = 0);

/// The differences between heating and cooling before and after.
std::string loop_meaning(const evaluation::Hysteresis& before, const evaluation::Hysteresis& after);
/// The part of the largest difference and of the loop's area that is removed. `knows_slope`: the model has the slope of
/// a temperature or a lag as input.
std::string hysteresis_meaning(const evaluation::Hysteresis& before, const evaluation::Hysteresis& after,
                               bool knows_slope);

/// The averaging times at which the correction helps or harms. Deviations at the same increasing averaging times.
std::string allan_curve_meaning(const std::vector<double>& tau_s, const std::vector<double>& before,
                                const std::vector<double>& after);
/// Does the model add noise, and why a bias instability may appear after compensation only.
std::string allan_meaning(const evaluation::AllanCoefficients& before, const evaluation::AllanCoefficients& after);

/// Is the residual white noise, or is a drift left that no input shows?
std::string residual_meaning(const evaluation::Autocorrelation& residual, int block_s);

/// The meaning of the share of blocks outside the training range.
std::string domain_meaning(std::size_t outside, std::size_t blocks);

}  // namespace prism::analysis
