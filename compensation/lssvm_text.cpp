// SPDX-License-Identifier: MIT
// The LSSVM part of the model file: normalisation, hyper-parameters, centres, alphas, weights and the uncertainty.
#include <fmt/format.h>

#include "compensation/centres.hpp"
#include "compensation/kernel_text.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/model_id.hpp"
#include "compensation/model_types.hpp"

namespace prism::compensation {

namespace {

LssvmUncertainty read_uncertainty(Section section) {
  LssvmUncertainty u;
  u.prior_variance = section.number("prior_variance", kPositive);
  u.sd_scale = section.number("sd_scale", {1, 1e6}, 1.0);
  u.guard_fraction = section.number("guard_fraction", kPositive);
  u.gram = symmetric_of(section, "gram", section.numbers("gram", kAnyNumber, false));
  return u;
}

std::string uncertainty_text(const LssvmUncertainty& u) {
  std::string text =
      fmt::format("  \"uncertainty\": {{\"prior_variance\": {}, \"sd_scale\": {}, \"guard_fraction\": {}",
                  exact_text(u.prior_variance), exact_text(u.sd_scale), exact_text(u.guard_fraction));
  if (u.gram.rows() > 0) text += ", \"gram\": [\n" + triangle_text(u.gram);
  return text + (u.gram.rows() > 0 ? "]},\n" : "},\n");
}

}  // namespace

Result<ModelPtr> read_lssvm(Section& top, ModelInfo info) {
  LssvmParameters p;
  p.c = top.number("c", kPositive);
  p.sigma2 = top.number("sigma2", kPositive);
  p.b = top.number("b", kAnyNumber);
  p.normalisation = read_normalisation(top.object("normalisation", true));
  p.linear = vector_of(top.numbers("linear", kAnyNumber, false));
  p.linear_b = top.number("linear_b", kAnyNumber, 0.0);
  if (top.has("uncertainty")) p.uncertainty.emplace(read_uncertainty(top.object("uncertainty")));
  const std::vector<double> centres = top.numbers("centres", kAnyNumber);
  p.alpha = vector_of(top.numbers("alpha", kAnyNumber));
  p.weight = vector_of(top.numbers("weight", kPositive, false));
  p.centres = centres_of(top, centres, info.inputs.size(), p.alpha.size());
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return LssvmModel::make(std::move(info), std::move(p));
}

std::string lssvm_content(const Model& model) {
  const LssvmParameters& p = static_cast<const LssvmModel&>(model).parameters();
  std::string text = fmt::format("  \"c\": {},\n  \"sigma2\": {},\n  \"b\": {},\n", exact_text(p.c),
                                 exact_text(p.sigma2), exact_text(p.b));
  text += normalisation_text(p.normalisation);
  if (p.linear.size() > 0)
    text += fmt::format("  \"linear\": {},\n  \"linear_b\": {},\n", exact_numbers(p.linear), exact_text(p.linear_b));
  if (p.uncertainty) text += uncertainty_text(*p.uncertainty);
  append_rows(text, "centres", p.centres, p.centres.rows());
  append_rows(text, "alpha", p.alpha, 4);
  if (p.weight.size() > 0) append_rows(text, "weight", p.weight, 4);
  return text;
}

}  // namespace prism::compensation
