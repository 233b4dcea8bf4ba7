// SPDX-License-Identifier: MIT
#include "compensation/polynomial_model.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "base/json_table.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/model.hpp"
#include "compensation/model_text.hpp"

namespace prism::compensation {
namespace {

std::string canonical(const std::vector<Term>& terms, double sd) {
  std::string text = std::isfinite(sd) ? exact_text(sd) : "";
  for (const Term& term : terms)
    text += fmt::format("\n{} {}", fmt::join(term.powers, " "), exact_text(term.coefficient));
  return text;
}

}  // namespace

PolynomialModel::PolynomialModel(ModelInfo info, std::vector<Term> terms, double sd_deg_per_h)
    : Model(std::move(info), canonical(terms, sd_deg_per_h)), terms_(std::move(terms)), sd_deg_per_h_(sd_deg_per_h) {
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

// The polynomial part of the model file: "terms" and the residual standard deviation.

namespace {

constexpr double kMaxPower = 9;
constexpr std::size_t kMaxTerms = 10000;  // prismd computes each of them once a second

struct PolynomialDraft {
  std::vector<Term> terms;
  double sd_deg_per_h = kUnknown;
};

JsonTable<Term> term_keys() {
  return JsonTable<Term>()
      .value(
          "powers", {{"type", "array"}, {"items", limits_schema("integer", {0, kMaxPower})}}, &Term::powers,
          {kRequired, "one per input"},
          [](const Section& section, const std::string& key) {
            std::vector<int> powers;
            for (const double power : section.numbers(key, {0, kMaxPower})) {
              if (power != std::floor(power)) section.fail(key, fmt::format("found {}, expected integers", power));
              powers.push_back(static_cast<int>(power));
            }
            return powers;
          },
          [](const std::vector<int>& powers) { return Json(powers); })
      .number("coefficient", kAnyNumber, &Term::coefficient, kRequired);
}

const JsonTable<PolynomialDraft>& polynomial_table() {
  using P = PolynomialDraft;
  static const JsonTable<P> keys =
      JsonTable<P>()
          .then([](const Section& top, P&) {
            const std::size_t terms = top.objects("terms").size();
            if (terms > kMaxTerms) top.fail("terms", fmt::format("found {}, expected at most {}", terms, kMaxTerms));
          })
          .number("sd_deg_per_h", {0, 1e9}, &P::sd_deg_per_h, "")
          .list("terms", term_keys(), &P::terms,
                {kRequired, "the bias is the sum of their coefficient times powers of the inputs"});
  return keys;
}

}  // namespace

Json polynomial_keys() { return polynomial_table().schema()["properties"]; }

Result<ModelPtr> read_polynomial(Section& top, ModelInfo info) {
  PolynomialDraft draft;
  polynomial_table().read(top, draft);
  for (std::size_t i = 0; i < draft.terms.size() && top.good(); ++i) {
    if (const std::size_t powers = draft.terms[i].powers.size(); powers != info.inputs.size())
      top.fail(fmt::format("terms/{}/powers", i),
               fmt::format("found {} powers, expected {}: one per input", powers, info.inputs.size()));
  }
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return std::make_shared<PolynomialModel>(std::move(info), std::move(draft.terms), draft.sd_deg_per_h);
}

Json print_polynomial(const Model& model) {
  const auto& polynomial = static_cast<const PolynomialModel&>(model);
  return polynomial_table().print({polynomial.terms(), polynomial.sd_deg_per_h()});
}

}  // namespace prism::compensation
