// SPDX-License-Identifier: MIT
#include "compensation/polynomial_model.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "compensation/extrapolation.hpp"
#include "compensation/model_id.hpp"

namespace prism::compensation {
namespace {

std::string canonical(const std::vector<Term>& terms, double sd) {
  std::string text = std::isfinite(sd) ? exact_text(sd) : "";
  for (const Term& term : terms)
    text += fmt::format("\n{} {}", fmt::join(term.powers, " "), exact_text(term.coefficient));
  return text;
}

// The info with the id of this content.
ModelInfo identified(ModelInfo info, const std::vector<Term>& terms, double sd) {
  info.id = model_id(info, canonical(terms, sd));
  return info;
}

}  // namespace

PolynomialModel::PolynomialModel(ModelInfo info, std::vector<Term> terms, double sd_deg_per_h)
    : Model(identified(std::move(info), terms, sd_deg_per_h)), terms_(std::move(terms)), sd_deg_per_h_(sd_deg_per_h) {
  measure_bias_span();
}

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
  Prediction prediction;
  prediction.bias_deg_per_h = bias;
  prediction.sd_deg_per_h = sd_deg_per_h_;
  prediction.extrapolating = outside_domain(inputs);
  if (!info().spread) return prediction;
  return stated(prediction, {0, 0, 1, 0, *info().spread, false}, 1);
}

}  // namespace prism::compensation
