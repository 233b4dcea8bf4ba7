// SPDX-License-Identifier: MIT
// Sample → Compensated, one for one: one-second means, window and model in one push().
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "base/result.hpp"
#include "compensation/compensated.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/features.hpp"
#include "compensation/model.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/second_averager.hpp"

namespace prism::compensation {

struct CompensationSettings {
  /// A predicted bias outside ± this limit is rejected (deg/h, > 0).
  double max_bias_deg_per_h = 100;
  /// How predictions outside the training range are published.
  Extrapolation extrapolation = Extrapolation::kPreset;
  /// Limits of plausible values.
  PlausibilityLimits plausibility = {};
  SlewSettings slew = {};

  bool operator==(const CompensationSettings&) const = default;
};

/// Implausible values are left out of the means of windows and are not corrected; their samples and rows are flagged.
///
/// Deterministic: the same samples and models return the same rows, live or replayed. Without a model, rows have
/// kNoModel.
class CompensationEngine {
 public:
  /// `sensors`: of the stream, in the order of the values for push().
  explicit CompensationEngine(CompensationSettings settings = {}, SensorList sensors = nullptr)
      : settings_(settings),
        plausibility_(settings.plausibility),
        sensors_(std::move(sensors)),
        averager_(sensors_),
        extractor_(FeatureDefinition{}) {}

  /// Takes over `model` and `fallback` (null: none); the fallback is used while the window is not full. If the features
  /// of the new model are the same, the window is kept and the new bias is in force at once; else the window restarts.
  /// Errors, without any change: a fallback with inputs other than T and U.
  Result<void> use(ModelPtr model, ModelPtr fallback);

  /// Corrects one sample; returns the window of the second that this sample closed, if any. The first sample after a
  /// gap above max_gap_s, or after the clock was set back, has no bias, never an old one. `values`: of the sensors at
  /// that time, kUnknown if unknown; empty: not read with this sample.
  std::optional<CompensatedWindow> push(const Sample& sample, Compensated& out, std::span<const double> values = {});
  /// Takes a one-second mean instead of its samples: for recordings.
  CompensatedWindow push(const SecondMean& second_mean) { return complete(second_mean); }
  /// Closes the open second at the end of a session or of a replay. No bias is in force afterwards.
  std::optional<CompensatedWindow> finish();
  /// Starts a new session of the device: clears all state.
  void reset();

  /// An offset by command, subtracted besides the bias of the next windows; kUnknown: none.
  void set_offset(double deg_per_h) { offset_deg_per_h_ = deg_per_h; }

  /// The prediction of the model, or of its fallback, for this window. Does not change the state.
  Correction correct(const Window& window) const;
  /// The published correction: the prediction, limited to the change since the window before that the slew limit
  /// allows. Takes windows in order of time; call break_off() if a window does not follow the one before.
  Correction follow(const Window& window);
  void break_off() { slew_.reset(); }

  const ModelPtr& model() const { return model_; }
  const ModelPtr& fallback() const { return fallback_; }
  const Correction& correction() const { return correction_; }

 private:
  CompensatedWindow complete(const SecondMean& second_mean);
  void forget_window();
  Correction predict(const Model& model, const Window& window) const;

  CompensationSettings settings_;
  ModelPtr model_, fallback_;
  Plausibility plausibility_;
  Rejections rejections_;  ///< of the open second
  SlewLimit slew_;
  SensorList sensors_;
  SecondAverager averager_;
  FeatureExtractor extractor_;
  std::optional<Window> window_;  ///< the source of correction_; none: no bias in force
  Correction correction_;
  double offset_deg_per_h_ = kUnknown;
};

}  // namespace prism::compensation
