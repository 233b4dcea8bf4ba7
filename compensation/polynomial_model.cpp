// SPDX-License-Identifier: MIT
#include "compensation/polynomial_model.hpp"

#include <cassert>
#include <utility>

namespace prism {

PolynomialModel::PolynomialModel(ModelInfo info, std::vector<Term> terms, double sd_deg_per_h)
    : Model(std::move(info)), terms_(std::move(terms)), sd_deg_per_h_(sd_deg_per_h) {}

Prediction PolynomialModel::predict(std::span<const double> inputs) const {
  assert(inputs.size() == info().inputs.size());
  double bias = 0;
  for (const Term& term : terms_) {
    double product = term.coefficient;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      for (int power = 0; power < term.powers[i]; ++power) product *= inputs[i];
    }
    bias += product;
  }
  return {bias, sd_deg_per_h_, outside_domain(inputs)};
}

}  // namespace prism
