// SPDX-License-Identifier: MIT
// What an engineer asks of one model on one recording, as tables and figures.
#pragma once

#include <string>
#include <vector>

#include "tools/prismcal/analysis/judgement.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// One recording and what the model made of it. Pointers do not own.
struct Evidence {
  std::string id;  ///< prefix of all table and figure ids, [a-z0-9_]
  const recordings::BlockTable* table = nullptr;
  const Judgement* judgement = nullptr;
  const recordings::BlockTable* training = nullptr;  ///< null: not at hand
  const std::vector<double>* weights = nullptr;      ///< v_k of the training blocks; null: not weighted or not at hand
};

/// Mean, 1 sigma, rms and peak-to-peak before and after, improvement, floor and explained share.
report::Table stability_table(const Evidence& evidence);
/// The same in short for every soak and ramp.
Result<report::Table> segment_table(const Evidence& evidence);
/// Loop between heating and cooling, and the sensitivity of each, before and after.
Result<report::Table> hysteresis_table(const Evidence& evidence);
/// Allan coefficients before and after from the 1 Hz series.
Result<report::Table> allan_table(const Evidence& evidence);

/// Temperature, its slope, UHFO and bias over time.
report::Figure record_figure(const recordings::BlockTable& table, const std::string& id);
/// Bias and model over time; what is left, and where the model was asked off its data.
report::Figure bias_figure(const Evidence& evidence);
/// Bias against temperature, heating and cooling told apart, before and after.
report::Figure thermal_figure(const Evidence& evidence);
/// Allan deviation before and after, with the 68 % band.
Result<report::Figure> allan_figure(const Evidence& evidence);
/// Histogram of what is left, and its autocorrelation.
Result<report::Figure> residual_figure(const Evidence& evidence);
/// The training blocks, those called outliers marked, and the weights over time. `evidence.weights` must be there.
report::Figure weights_figure(const Evidence& evidence);
/// Training blocks and evaluated blocks in the planes of T with dT/dt and with U. `evidence.training` must be there.
report::Figure domain_figure(const Evidence& evidence);

/// All of these that the evidence carries, tables first; what is refused becomes a paragraph that says why.
std::vector<report::Block> evidence_blocks(const Evidence& evidence);

}  // namespace prism::analysis
