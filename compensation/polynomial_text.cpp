// SPDX-License-Identifier: MIT
// The polynomial part of the model file: "terms" and the residual standard deviation.
#include <fmt/format.h>

#include <cmath>

#include "compensation/model_id.hpp"
#include "compensation/model_types.hpp"
#include "compensation/polynomial_model.hpp"

namespace prism::compensation {
namespace {

constexpr double kMaxPower = 9;
constexpr std::size_t kMaxTerms = 10000;  // prismd computes each of them once a second

std::vector<Term> read_terms(Section& top, std::size_t inputs) {
  std::vector<Term> terms;
  std::vector<Section> sections = top.objects("terms");
  if (sections.size() > kMaxTerms)
    top.fail("terms", fmt::format("found {}, expected at most {}", sections.size(), kMaxTerms));
  for (Section& section : sections) {
    if (!top.good()) break;
    Term term;
    for (const double power : section.numbers("powers", {0, kMaxPower})) {
      if (power != std::floor(power)) section.fail("powers", fmt::format("found {}, expected integers", power));
      term.powers.push_back(static_cast<int>(power));
    }
    if (section.good() && term.powers.size() != inputs) {
      section.fail("powers", fmt::format("found {} powers, expected {}: one per input", term.powers.size(), inputs));
    }
    term.coefficient = section.number("coefficient", kAnyNumber);
    terms.push_back(std::move(term));
  }
  return terms;
}

}  // namespace

Result<ModelPtr> read_polynomial(Section& top, ModelInfo info) {
  std::vector<Term> terms = read_terms(top, info.inputs.size());
  const double sd = top.has("sd_deg_per_h") ? top.number("sd_deg_per_h", {0, 1e9}) : kUnknown;
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return std::make_shared<PolynomialModel>(std::move(info), std::move(terms), sd);
}

std::string polynomial_content(const Model& model) {
  const auto& polynomial = static_cast<const PolynomialModel&>(model);
  std::string text;
  if (std::isfinite(polynomial.sd_deg_per_h())) {
    text += fmt::format("  \"sd_deg_per_h\": {},\n", exact_text(polynomial.sd_deg_per_h()));
  }
  text += "  \"terms\": [";
  const char* separator = "\n";
  for (const Term& term : polynomial.terms()) {
    text += fmt::format("{}    {{\"powers\": [{}], \"coefficient\": {}}}", separator, fmt::join(term.powers, ", "),
                        exact_text(term.coefficient));
    separator = ",\n";
  }
  return text + "\n  ],\n";
}

}  // namespace prism::compensation
