// SPDX-License-Identifier: MIT
// Sample → Compensated, one for one: buckets, window and model behind one push().
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "base/result.hpp"
#include "compensation/averager.hpp"
#include "compensation/compensated.hpp"
#include "compensation/conditioner.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/slew_limit.hpp"

namespace prism::compensation {

struct EngineSettings {
  /// A predicted bias beyond ± this is not believed (deg/h, > 0).
  double max_bias_deg_per_h = 100;
  /// How predictions are served, and what is published where the model is asked off its data.
  Extrapolation extrapolation = Extrapolation::kPreset;
  /// What of a sample is believed.
  PlausibilityLimits plausibility = {};
  SlewSettings slew = {};

  bool operator==(const EngineSettings&) const = default;
};

/// What is implausible is in no mean of a window and is not corrected; samples and rows that hold it are marked.
///
/// Deterministic: the same samples and models give the same rows, live or replayed. No model: rows carry kNoModel.
class Engine {
 public:
  /// `sensors`: of the stream, as push() is given their values.
  explicit Engine(EngineSettings settings = {}, SensorList sensors = nullptr)
      : settings_(settings),
        plausibility_(settings.plausibility),
        sensors_(std::move(sensors)),
        averager_(sensors_),
        conditioner_(FeatureDefinition{}) {}

  /// Takes over `model` (null: none) and `fallback` (null: none), which serves while the window is not full. The window
  /// is kept where the new model defines its features alike (its bias is then in force at once), else it warms anew. A
  /// fallback with inputs other than T and U is refused, and everything stays as it was.
  Result<void> use(ModelPtr model, ModelPtr fallback);

  /// Corrects one sample; returns the window of a second that this sample closed. The first sample behind a gap longer
  /// than the model's max_gap_s, or behind a clock that was set back, already finds no bias: never the one of before.
  /// `values`: of the sensors at that moment, unknown ones kUnknown; empty: not read with this sample.
  std::optional<CompensatedWindow> push(const Sample& sample, Compensated& out, std::span<const double> values = {});
  /// Closes the second still open: the end of a session or of a replay. No bias is in force afterwards.
  std::optional<CompensatedWindow> finish();
  /// A new session of the device: nothing of the past holds.
  void reset();

  /// What the model in use or its fallback says of this window; nothing is kept.
  Correction correct(const Window& window) const;
  /// What is published for it: the same, no further from what was published for the window before than the slew limit
  /// allows in the time between. Windows come in order of time; call break_off() where one does not follow another.
  Correction follow(const Window& window);
  void break_off() { slew_.reset(); }

  const ModelPtr& model() const { return model_; }
  const ModelPtr& fallback() const { return fallback_; }
  const Correction& correction() const { return correction_; }

 private:
  CompensatedWindow complete(const Bucket& bucket);
  void forget_window();
  Correction predict(const Model& model, const Window& window) const;

  EngineSettings settings_;
  ModelPtr model_, fallback_;
  Plausibility plausibility_;
  Doubts doubts_;  ///< of the second that is open
  SlewLimit slew_;
  SensorList sensors_;
  Averager averager_;
  Conditioner conditioner_;
  std::optional<Window> window_;  ///< what correction_ was predicted from; none: no bias in force
  Correction correction_;
};

}  // namespace prism::compensation
