// SPDX-License-Identifier: MIT
// One model on one recording: all values, computed once, and the tables and figures of the report with their meanings.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/evaluation/thermal.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/model_evaluation.hpp"

namespace prism::analysis {

/// A value before and after the correction.
template <class T>
struct BeforeAfter {
  T before, after;
  const T& of(bool corrected) const { return corrected ? after : before; }
};

/// One recording and the evaluation of a model on it.
struct EvaluatedRecording {
  std::string id;  ///< prefix of all table and figure ids, [a-z0-9_]
  recordings::Loaded loaded;
  ModelEvaluation evaluation;
  std::string overlap;              ///< with the training data (overlap_text()); empty: none known
  std::vector<std::string> doubts;  ///< recording_doubts(): it may be the reason of its result

  std::vector<double> hours, temperature_degc;  ///< of each block
  std::vector<evaluation::ThermalKind> kinds;   ///< of each block
  /// Heating against cooling in bins of 5 degC, over blocks with a correction (largest_gap()).
  BeforeAfter<std::optional<double>> gap_deg_per_h;
  /// Of the rates of seconds.
  BeforeAfter<Result<evaluation::AllanAnalysis>> allan;
  BeforeAfter<Result<evaluation::Spectrum>> spectrum;
};
EvaluatedRecording evaluate_recording(std::string id, recordings::Loaded loaded, ModelEvaluation evaluation);

/// A quantity that can have limits, measured on one recording; nullopt if the recording does not determine it.
struct Measured {
  std::string quantity, unit;
  std::optional<double> value;
  bool at_most = false;  ///< the value is an upper bound
};
/// Names of all quantities that can have limits.
std::vector<std::string> measured_names();
/// Returns all quantities, in the order of measured_names().
std::vector<Measured> measure_all(const EvaluatedRecording& recording);

/// The improvement, with `further` also that to expect in another recording, and the share of blocks outside the
/// training range. If recording.overlap is not empty, it states that this is not a test.
report::Paragraph result_paragraph(const EvaluatedRecording& recording, bool further);

/// Temperature, its slope, UHFO and bias over time.
report::Figure record_figure(const EvaluatedRecording& recording);

/// Makes all other tables and figures that the recording allows, one after the other. An error becomes a paragraph with
/// its text. To add one, write its function in recording_report.cpp and a row there.
void add_recording_blocks(const EvaluatedRecording& recording, const std::function<void(report::Block)>& take);

/// Panels of the Allan deviations and of the densities of one or two curves, with the periodic lines.
struct NoiseCurve {
  const char* name;
  report::Ink ink;
  const evaluation::AllanAnalysis* allan;
  const evaluation::Spectrum* spectrum;  ///< null: unknown
};
inline constexpr const char* kNoiseCaption =
    "(a) Overlapping Allan deviation, bands: 68 %, chi-square with the degrees of freedom of the fitted noises. (b) "
    "One-sided power spectral density, Welch, Hann windows of at most an eighth of the record; circles: periodic "
    "parts.";
report::Plot noise_plot(const std::vector<NoiseCurve>& curves);

/// "Periodic: 0.0333 Hz (30 s), amplitude 0.05 deg/h.", or a sentence that no part is periodic.
std::string lines_text(const evaluation::Spectrum& spectrum);

/// Names the averaging times that the five noises do not explain; empty if they explain all.
std::string unexplained_text(const evaluation::AllanAnalysis& analysis);

// Conclusions for this gyro from the values of a table or figure: one sentence each.

/// Is white noise all that is left, or could a better model remove more?
std::string stability_meaning(const evaluation::BiasStability& stability, bool doubtful = false);
/// Is the correction as good while the temperature changes as in soaks? One value per block.
std::string segments_meaning(const std::vector<evaluation::ThermalKind>& kinds,
                             const std::vector<double>& bias_deg_per_h, const std::vector<double>& corrected_deg_per_h,
                             double extrapolated_percent = 0);
/// The largest differences between heating and cooling. `knows_slope`: the model has the slope of a temperature.
std::string loop_meaning(std::optional<double> before, std::optional<double> after, bool knows_slope);
/// The averaging times at which the correction helps or harms, of those that both have.
std::string allan_curve_meaning(const report::Series& before, const report::Series& after);
/// Does the model add noise, and why a bias instability may appear after compensation only.
std::string allan_meaning(const evaluation::AllanCoefficients& before, const evaluation::AllanCoefficients& after);
/// Is the residual white noise, or is a drift left that no input shows?
std::string residual_meaning(const evaluation::Autocorrelation& residual, int block_s);

/// The parameters of a gyro in the terms of IEEE Std 647 and 952, from all recordings of an evaluation together, before
/// and after the correction. `warm_up_band_deg_per_h`: nullopt: the white noise of a block, rounded up to one digit.
report::Table parameters_table(const std::vector<EvaluatedRecording>& recordings,
                               std::optional<double> warm_up_band_deg_per_h);
/// Those of the noises alone, of a rate without a correction.
report::Table noise_parameters_table(const evaluation::AllanAnalysis& analysis);

}  // namespace prism::analysis
