// SPDX-License-Identifier: MIT
// Tables and figures on one model and one recording.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/hysteresis.hpp"
#include "tools/prismcal/analysis/model_evaluation.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// One recording and the evaluation of a model on it. Pointers are not owned.
struct EvaluatedRecording {
  std::string id;  ///< prefix of all table and figure ids, [a-z0-9_]
  const recordings::BlockTable* table = nullptr;
  const ModelEvaluation* evaluation = nullptr;
  const recordings::BlockTable* training = nullptr;  ///< null: unknown
  bool doubtful = false;                             ///< the recording may be the reason of its result
};

/// Hysteresis between heating and cooling in bins of kHysteresisBin degC, over blocks with a correction. `bias`: of all
/// blocks.
inline constexpr double kHysteresisBin = 5;
Result<evaluation::Hysteresis> measure_loop(const EvaluatedRecording& recording, const std::vector<double>& bias);
/// Allan analysis of the rates of seconds.
Result<evaluation::AllanAnalysis> analyse_seconds(const std::vector<recordings::Series>& seconds,
                                                  const std::string& where);

/// Of the 1 Hz series before and after the correction.
struct AllanPair {
  Result<evaluation::AllanAnalysis> before, after;
};
AllanPair analyse_both(const EvaluatedRecording& recording);

/// One sentence on the improvement and the share of blocks outside the training range. If `overlap` (see
/// overlap_text()) is not empty, it states that this is not a test.
report::Paragraph result_paragraph(const EvaluatedRecording& recording, const std::string& overlap);
/// Mean, 1 sigma, rms, peak to peak before and after; improvement, white-noise floor and explained share.
report::Table stability_table(const EvaluatedRecording& recording);
/// Mean and 1 sigma before and after for each soak and ramp.
Result<report::Table> segment_table(const EvaluatedRecording& recording);
/// Hysteresis and temperature sensitivity of heating and cooling, before and after.
Result<report::Table> hysteresis_table(const EvaluatedRecording& recording);
/// Allan coefficients before and after.
Result<report::Table> allan_table(const EvaluatedRecording& recording, const AllanPair& allan);

/// Temperature, its slope, UHFO and bias over time.
report::Figure record_figure(const recordings::BlockTable& table, const std::string& id);
/// Bias and model over time, the residual, and the blocks outside the training range.
report::Figure bias_figure(const EvaluatedRecording& recording);
/// Bias against temperature, with different points for heating and cooling, before and after.
report::Figure thermal_figure(const EvaluatedRecording& recording);
/// Allan deviation before and after, with the 68 % band.
Result<report::Figure> allan_figure(const EvaluatedRecording& recording, const AllanPair& allan);
/// Histogram and autocorrelation of the residual.
Result<report::Figure> residual_figure(const EvaluatedRecording& recording);
/// Training and evaluated blocks in the planes (T, dT/dt) and (T, U). `recording.training` must not be null.
report::Figure domain_figure(const EvaluatedRecording& recording);

/// Makes all tables and figures above that the recording allows, one after the other. An error becomes a paragraph with
/// its text.
void add_recording_blocks(const EvaluatedRecording& recording, const std::function<void(report::Block)>& take);

}  // namespace prism::analysis
