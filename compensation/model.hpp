// SPDX-License-Identifier: MIT
// The interface of bias models: inputs of one window → bias, its standard deviation, and the extrapolation flag.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {

/// The error between a new run and the model of another run that no input explains; standard deviations.
struct BetweenRunError {
  double nuisance_deg_per_h = 0;  ///< s4, s5: drift in time, and differences between recordings if there are several
  double offset_deg_per_h = 0;    ///< between runs, if trained on one recording: assumed, kAssumedOffset
  double noise_deg_per_h = 0;     ///< of the window's mean rate
  double factor = 1;              ///< on all of them: error of held-out blocks over the model's own estimate, > 0
  int blocks = 0;                 ///< held-out blocks that factor or nuisance are estimated from; 0: none
  int samples = 0;                ///< in them
  bool operator==(const BetweenRunError&) const = default;
};

/// Noise of the rate in the training recording, after the correction.
struct RateNoise {
  double n_deg_per_sqrt_h = 0;  ///< angle random walk N
  double b_deg_per_h = 0;       ///< bias instability B; 0: below the other noises
  double second_deg_per_h = 0;  ///< sd of one-second means within a window, with the rate's resolution
  bool operator==(const RateNoise&) const = default;
};

/// Settings of the test that finds a drift of the bias (evaluation/drift_test.hpp).
struct MonitorSettings {
  int every = 1;                ///< windows per value
  double sd_deg_per_h = 0;      ///< of the values, in held-out blocks
  double offset_deg_per_h = 0;  ///< sd between switch-ons
  double correlation = 0;       ///< of neighbouring values
  double threshold = 0;         ///< of the sums, in sd: one false alarm in a year at rest
  double delay_h = 0;           ///< a shift of 1 sd is found within twice this time at rest in 95 % of all cases
  std::int64_t since_s = 0;     ///< since 1970: rows before it had another constant of the bias; 0: of all rows
  bool operator==(const MonitorSettings&) const = default;
};

/// The assumed offset between two runs of a gyro with one recording, in standard deviations of its bias: its cycles
/// differ by a tenth (docs/benchmarks.md).
inline constexpr double kAssumedOffset = 0.1;

/// Predictive uncertainty at one point; variances in (deg/h)².
struct PredictiveUncertainty {
  double model_variance = 0;   ///< v: of the prediction alone
  double target_variance = 0;  ///< var_y: of the training target
  double skill = 1;            ///< r: cross-prediction skill score (1 − MSE / variance) of the worse half; at most 1
  double excess = 0;           ///< o: distance outside the training range, in ranges; the model weighs its inputs
  BetweenRunError spread;
  bool preset = false;  ///< the model type is shrunk by default
  double overlap = 1;   ///< share of that half that the other half knows: 1 if their inputs overlap
  /// The prediction at the edge of the training range: slopes as they are, other inputs at their nearest value.
  struct Edge {
    double bias_deg_per_h = 0, model_variance = 0;
  };
  std::optional<Edge> edge = std::nullopt;  ///< none in models of version 0.2
};

struct Prediction {
  double bias_deg_per_h = kUnknown;
  /// Standard deviation of (true bias − prediction) in a new run. Models without BetweenRunError return their own
  /// uncertainty, a fit's residual, or kUnknown.
  double sd_deg_per_h = kUnknown;
  double sd_mean_deg_per_h = kUnknown;  ///< with the noise of the window's mean rate; kUnknown without BetweenRunError
  bool extrapolating = false;           ///< outside the training box, or the model's own variance exceeds its guard
  double mean_deg_per_h = kUnknown;     ///< of the training target; kUnknown if the model does not contain it
  std::optional<PredictiveUncertainty> knowledge;  ///< for the shrink policy; without it, the prediction is not shrunk
};

/// Closed ranges of each input in the training data; empty: unknown.
struct Domain {
  std::vector<double> min, max;  ///< one per input, in the input's unit
  bool operator==(const Domain&) const = default;
};

/// Properties of every model, of any type.
struct ModelInfo {
  std::string kind;  ///< "polynomial", "stepwise", "lssvm", "ir_lssvm", …
  std::string name;  ///< label for the user; not part of the id
  std::string id;    ///< SHA-256 of the canonical numeric content, 64 hex digits
  /// Trained on a CSV table: inputs have any names, there are no features, and it cannot be used with a stream.
  bool table = false;
  FeatureDefinition features;
  std::vector<std::string> inputs;  ///< in the order of predict()
  Domain domain;
  /// None in models of version 0.1: their standard deviation is the model's own.
  std::optional<BetweenRunError> spread;
  std::optional<RateNoise> noise;          ///< not part of the id; none in models of version 0.4 and earlier
  std::optional<MonitorSettings> monitor;  ///< as noise
  std::string gyro_serial;                 ///< empty: any gyro
  std::string gyro_axis;                   ///< of that gyro; empty: any axis
  bool id_has_serial = true;    ///< false: of a file of version 1, whose id does not depend on the serial number
  std::string provenance_json;  ///< the file's "provenance" object as text; "{}" if absent
};

class Model {
 public:
  virtual ~Model() = default;

  const ModelInfo& info() const { return info_; }

  /// Bias at one point. `inputs` has info().inputs.size() finite numbers in the units of features.hpp. Pure.
  virtual Prediction predict(std::span<const double> inputs) const = 0;

  /// The bias alone; the same value as predict().bias_deg_per_h.
  virtual double bias_deg_per_h(std::span<const double> inputs) const { return predict(inputs).bias_deg_per_h; }

  /// Largest minus smallest bias over the training box, deg/h, >= 0: on an even grid of at most 1024 points that
  /// includes the corners. kUnknown if the model has no box or more than 10 inputs.
  double bias_span_deg_per_h() const { return bias_span_deg_per_h_; }

 protected:
  /// Ignores info.id: the id is computed, with the numbers of the type (`content`) as in model_id().
  Model(ModelInfo info, std::string_view content);
  /// Returns true outside the training range and its margin.
  bool outside_domain(std::span<const double> inputs) const;
  /// The distance of the inputs outside their training ranges, in ranges; 0 inside the box. Without shares the largest
  /// of an input; with them (one per input, sum 1) the root of their mean square.
  double excess(std::span<const double> inputs, std::span<const double> shares = {}) const;
  /// Computes the span: call it at the end of construction, when bias_deg_per_h() works.
  void measure_bias_span();

 private:
  ModelInfo info_;
  double bias_span_deg_per_h_ = kUnknown;
};

using ModelPtr = std::shared_ptr<const Model>;

/// Distance outside the training range of an input that is not yet `extrapolating`, in multiples of the range. For a
/// repeat of the training profile, models with BetweenRunError allow a margin (docs/benchmarks.md): 2 %, 20 % if the
/// input is dT/dt or U.
double margin_of(const ModelInfo& info, std::size_t input);

/// The inputs of `model` taken from a window, in the model's order; empty if any is unknown.
std::vector<double> gather_inputs(const Model& model, const Window& window);

// The identity of a model: SHA-256 over its numbers, so that a model has the same id wherever it was written.

/// Version 2: the id depends on the serial number. Models for any gyro are written as version 1, which prism 0.2 reads.
/// Version 3: with a response, which prism 0.4 would ignore.
inline constexpr int kModelVersion = 3;
inline constexpr std::array kSlopeNames = {"difference", "least_squares"};  ///< in the order of SlopeMethod

/// Version of the file of a model.
int model_version(const ModelInfo& info);

/// Canonical id: version, model type, features, inputs, domain, the numbers of the type (`content`, exact), the
/// serial number and its axis (see ModelInfo::id_has_serial). Names and provenance are not included.
std::string model_id(const ModelInfo& info, std::string_view content);

/// The shortest text (at most 17 digits) that reads back as the same double.
std::string exact_text(double value);
std::string exact_texts(std::span<const double> values);

}  // namespace prism::compensation
