// SPDX-License-Identifier: MIT
// Tables and figures on one model and one recording.
#pragma once

#include <string>
#include <vector>

#include "compensation/evaluation/allan_coefficients.hpp"
#include "compensation/evaluation/hysteresis.hpp"
#include "tools/prismcal/analysis/model_evaluation.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// One recording and what the model made of it. Pointers do not own.
struct EvaluatedRecording {
  std::string id;  ///< prefix of all table and figure ids, [a-z0-9_]
  const recordings::BlockTable* table = nullptr;
  const ModelEvaluation* evaluation = nullptr;
  const recordings::BlockTable* training = nullptr;  ///< null: not at hand
  const std::vector<double>* weights = nullptr;      ///< v_k of the training blocks; null: not weighted or not at hand
};

/// Heating against cooling of the blocks that have a correction, in bins of kHysteresisBin degC; `bias` of all blocks.
inline constexpr double kHysteresisBin = 5;
Result<evaluation::Hysteresis> measure_loop(const EvaluatedRecording& recording, const std::vector<double>& bias);
/// Octave points of a 1 Hz series, their confidence and coefficients.
Result<evaluation::AllanCoefficients> allan_coefficients(const std::vector<double>& seconds, const std::string& where);

/// One sentence on what the model does to this recording, and how much of it is outside its training range. `overlap`
/// (what it shares with the training, or empty) makes it "not a test".
report::Paragraph verdict_paragraph(const EvaluatedRecording& recording, const std::string& overlap);
/// Mean, 1 sigma, rms and peak-to-peak before and after, improvement, floor and explained share.
report::Table stability_table(const EvaluatedRecording& recording);
/// The same in short for every soak and ramp.
Result<report::Table> segment_table(const EvaluatedRecording& recording);
/// Loop between heating and cooling, and the sensitivity of each, before and after.
Result<report::Table> hysteresis_table(const EvaluatedRecording& recording);
/// Allan coefficients before and after from the 1 Hz series.
Result<report::Table> allan_table(const EvaluatedRecording& recording);

/// Temperature, its slope, UHFO and bias over time.
report::Figure record_figure(const recordings::BlockTable& table, const std::string& id);
/// Bias and model over time, the residual, and the blocks outside the training range.
report::Figure bias_figure(const EvaluatedRecording& recording);
/// Bias against temperature, heating and cooling told apart, before and after.
report::Figure thermal_figure(const EvaluatedRecording& recording);
/// Allan deviation before and after, with the 68 % band.
Result<report::Figure> allan_figure(const EvaluatedRecording& recording);
/// Histogram of what is left, and its autocorrelation.
Result<report::Figure> residual_figure(const EvaluatedRecording& recording);
/// The training blocks, those called outliers marked, and the weights over time. `recording.weights` must be there.
report::Figure weights_figure(const EvaluatedRecording& recording);
/// Training blocks and evaluated blocks in the planes of T with dT/dt and with U. `recording.training` must be there.
report::Figure domain_figure(const EvaluatedRecording& recording);

/// All of these that the recording allows, tables first; an error becomes a paragraph with its text.
std::vector<report::Block> recording_blocks(const EvaluatedRecording& recording);

}  // namespace prism::analysis
