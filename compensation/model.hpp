// SPDX-License-Identifier: MIT
// The bias model's contract: inputs of one window → bias, its standard deviation, and whether it was asked off its
// data.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {

/// What separates a run that was not seen from the model of another one, whatever the inputs say; standard deviations.
struct Spread {
  double nuisance_deg_per_h =
      0;  ///< s4, s5: what moves with time, and from recording to recording where there are several
  double offset_deg_per_h = 0;  ///< from run to run where one recording alone was trained: assumed, kAssumedOffset
  double noise_deg_per_h = 0;   ///< of the window's mean rate
  double factor = 1;            ///< on all of them: what held-out blocks say of the model's own, > 0
  int blocks = 0;               ///< how many held-out blocks told factor or nuisance; 0: none
  int samples = 0;              ///< in them
  bool operator==(const Spread&) const = default;
};

/// The offset between two runs of a gyro that was recorded once, in standard deviations of its bias: the tenth by which
/// its cycles differ (docs/science.md).
inline constexpr double kAssumedOffset = 0.1;

/// What a model knows of its own ignorance at one point; variances in (deg/h)².
struct Knowledge {
  double model_variance = 0;   ///< v: of the prediction alone
  double target_variance = 0;  ///< var_y: of the training target
  double skill = 1;            ///< r: how well each half of the record predicts the other, the worse; at most 1
  double excess = 0;           ///< o: how far an input lies outside its training range, in ranges; the worst
  Spread spread;
  bool preset = false;  ///< made to be shrunk: served so unless a person says otherwise
};

struct Prediction {
  double bias_deg_per_h = kUnknown;
  /// Standard deviation of (true bias − prediction) in a run that was not seen; of models without Spread what they
  /// have: their own uncertainty, a fit's residual, or kUnknown.
  double sd_deg_per_h = kUnknown;
  double sd_mean_deg_per_h = kUnknown;  ///< with the noise of the window's mean rate; kUnknown without Spread
  bool extrapolating = false;           ///< outside the training box, or where the model's own variance says so
  double mean_deg_per_h = kUnknown;     ///< of the training target; kUnknown where the model does not say
  std::optional<Knowledge> knowledge;   ///< for the shrink policy; none: it leaves the prediction as it is
};

/// Closed ranges of each input in the training data; empty: not known.
struct Domain {
  std::vector<double> min, max;  ///< one per input, in the input's unit
  bool operator==(const Domain&) const = default;
};

/// What every model states about itself, whatever its kind.
struct ModelInfo {
  std::string kind;  ///< "polynomial", "stepwise", "lssvm", "ir_lssvm", …
  std::string name;  ///< for people; not part of the id
  std::string id;    ///< SHA-256 of the canonical numeric content, 64 hex digits
  /// Trained on a plain table: inputs have any names, there are no features, and no stream can feed it.
  bool table = false;
  FeatureDefinition features;
  std::vector<std::string> inputs;  ///< in the order predict() takes them
  Domain domain;
  /// Models of version 0.1 have none: their standard deviation is the model's own.
  std::optional<Spread> spread;
  std::string gyro_serial;      ///< empty: any gyro
  std::string provenance_json;  ///< the file's "provenance" object as text; "{}" where it has none
};

class Model {
 public:
  virtual ~Model() = default;

  const ModelInfo& info() const { return info_; }

  /// Bias at one point. `inputs` has info().inputs.size() finite numbers in the units of features.hpp. Pure.
  virtual Prediction predict(std::span<const double> inputs) const = 0;

  /// The bias alone; same number as predict().bias_deg_per_h.
  virtual double bias_deg_per_h(std::span<const double> inputs) const { return predict(inputs).bias_deg_per_h; }

  /// Greatest less smallest bias over the training box, deg/h, >= 0: on an even grid of at most 1024 points with the
  /// box's corners in it. kUnknown where the model states no box or has more inputs than a grid takes (10).
  double bias_span_deg_per_h() const { return bias_span_deg_per_h_; }

 protected:
  explicit Model(ModelInfo info) : info_(std::move(info)) {}
  /// Models with Spread leave a repeat of their profile some room (docs/science.md): 2 % of the range, 20 % where an
  /// input is dT/dt, U or a lag.
  bool outside_domain(std::span<const double> inputs) const;
  /// How far the input that is worst off lies outside its training range, in ranges; 0 inside the box.
  double excess(std::span<const double> inputs) const;
  /// Sets the span: for the end of the making, once bias_deg_per_h() works.
  void measure_bias_span();

 private:
  ModelInfo info_;
  double bias_span_deg_per_h_ = kUnknown;
};

using ModelPtr = std::shared_ptr<const Model>;

/// The inputs of `model` taken from a window, in the model's order; empty where any is unknown.
std::vector<double> gather_inputs(const Model& model, const Window& window);

}  // namespace prism::compensation
