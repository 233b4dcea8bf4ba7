// SPDX-License-Identifier: MIT
// The bias model's contract: inputs of one window → bias, its standard deviation, and whether it was asked off its
// data.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "compensation/features.hpp"

namespace prism::compensation {

struct Prediction {
  double bias_deg_per_h = kUnknown;
  double sd_deg_per_h = kUnknown;  ///< predictive standard deviation of the bias; kUnknown where the model has none
  bool extrapolating = false;      ///< outside the training box, or where the model's own variance says so
  /// For the blend policy: how far the data reach here, 1 (at the data) to 0 (prior only), and the model's own linear
  /// part or mean, which it falls back on; kUnknown where the model has none.
  double trust = 1;
  double mean_deg_per_h = kUnknown;
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
  std::string gyro_serial;      ///< empty: any gyro
  std::string provenance_json;  ///< the file's "provenance" object as text; "{}" where it has none
};

class Model {
 public:
  virtual ~Model() = default;

  const ModelInfo& info() const { return info_; }

  /// Bias at one point. `inputs` has info().inputs.size() finite numbers in the units of features.hpp. Pure.
  virtual Prediction predict(std::span<const double> inputs) const = 0;

 protected:
  explicit Model(ModelInfo info) : info_(std::move(info)) {}
  bool outside_domain(std::span<const double> inputs) const;

 private:
  ModelInfo info_;
};

using ModelPtr = std::shared_ptr<const Model>;

/// The inputs of `model` taken from a window, in the model's order; empty where any is unknown.
std::vector<double> gather_inputs(const Model& model, const Window& window);

}  // namespace prism::compensation
