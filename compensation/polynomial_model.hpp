// SPDX-License-Identifier: MIT
// Polynomials in the inputs: the paper's LS model (eq. 21) and both stepwise models (eqs. 22 to 25).
#pragma once

#include "compensation/model.hpp"

namespace prism::compensation {

/// coefficient · Π inputs[i]^powers[i]
struct Term {
  std::vector<int> powers;  ///< one per input, 0 to 9
  double coefficient = 0;   ///< deg/h over the product of the inputs' units
  bool operator==(const Term&) const = default;
};

class PolynomialModel final : public Model {
 public:
  /// Computes the id and ignores info.id. `info.kind` is "polynomial" or "stepwise"; every term has info.inputs.size()
  /// powers. sd_deg_per_h: residual standard deviation of the fit, kUnknown if unknown.
  PolynomialModel(ModelInfo info, std::vector<Term> terms, double sd_deg_per_h = kUnknown);

  Prediction predict(std::span<const double> inputs) const override;
  const std::vector<Term>& terms() const { return terms_; }
  double sd_deg_per_h() const { return sd_deg_per_h_; }

 private:
  std::vector<Term> terms_;
  double sd_deg_per_h_;
};

}  // namespace prism::compensation
