// SPDX-License-Identifier: MIT
// The composite kernel's part of the model file: variances, centres and the uncertainty parameters.
#include <fmt/format.h>

#include "compensation/centres.hpp"
#include "compensation/composite_model.hpp"
#include "compensation/kernel_text.hpp"
#include "compensation/model_id.hpp"
#include "compensation/model_text.hpp"
#include "compensation/model_types.hpp"

namespace prism::compensation {
namespace {

CompositeVariances read_variances(Section section) {
  CompositeVariances v;
  v.kernel.rbf = section.number("smooth", kPositive);
  v.kernel.length2 = vector_of(section.numbers("length_squared", kPositive));
  v.kernel.linear = section.number("linear", kPositive);
  v.kernel.quadratic = section.number("quadratic", kPositive);
  v.nuisance = section.number("nuisance", kPositive);
  v.nuisance_time_h = section.number("nuisance_time_h", kPositive);
  v.offset = section.number("offset", {0, 1e300}, 0.0);
  v.noise = section.number("noise", kPositive);
  v.warm_up = section.number("warm_up", {0, 1e300}, 0.0);
  return v;
}

UncertaintySettings read_trust(Section section) {
  UncertaintySettings t;
  t.skill = section.number("skill", {-1e300, 1});
  t.level = section.number("level", {0, 1e300});
  t.guard = section.number("guard", kPositive);
  t.overlap = section.number("overlap", {0, 1}, 1.0);
  t.relevance = section.numbers("relevance", {0, 1}, false);
  return t;
}

std::optional<PopulationPrior> read_prior(Section section) {
  PopulationPrior prior;
  prior.scale = section.number("scale", kPositive);
  prior.levels = section.numbers("levels", kAnyNumber);
  for (Section& sibling : section.objects("models")) {
    const auto model = read_model(sibling);
    if (!model && sibling.good()) sibling.fail("", model.error().what);
    if (!sibling.good()) return std::nullopt;
    prior.models.push_back(*model);
  }
  return prior;
}

std::string prior_text(const PopulationPrior& prior) {
  std::string text = fmt::format("  \"prior\": {{\"scale\": {}, \"levels\": {}, \"models\": [\n",
                                 exact_text(prior.scale), exact_texts(prior.levels));
  for (const ModelPtr& sibling : prior.models) {
    std::string model = format_model(*sibling);
    model.pop_back();  // the line end
    text += model + (sibling == prior.models.back() ? "" : ",\n");
  }
  return text + "]},\n";
}

std::string variances_text(const CompositeVariances& v) {
  return fmt::format(
      "  \"variances\": {{\"smooth\": {}, \"length_squared\": {}, \"linear\": {}, \"quadratic\": {}, \"nuisance\": {}, "
      "\"nuisance_time_h\": {}, \"offset\": {}, \"noise\": {}{}}},\n",
      exact_text(v.kernel.rbf), exact_numbers(v.kernel.length2), exact_text(v.kernel.linear),
      exact_text(v.kernel.quadratic), exact_text(v.nuisance), exact_text(v.nuisance_time_h), exact_text(v.offset),
      exact_text(v.noise), v.warm_up > 0 ? ", \"warm_up\": " + exact_text(v.warm_up) : "");
}

}  // namespace

Result<ModelPtr> read_composite(Section& top, ModelInfo info) {
  CompositeParameters p;
  p.variances = read_variances(top.object("variances", true));
  p.trust = read_trust(top.object("trust", true));
  p.beta = top.number("beta", kAnyNumber);
  p.normalisation = read_normalisation(top.object("normalisation", true));
  const std::vector<double> centres = top.numbers("centres", kAnyNumber);
  p.alpha = vector_of(top.numbers("alpha", kAnyNumber));
  p.weight = vector_of(top.numbers("weight", kPositive, false));
  p.time_h = vector_of(top.numbers("time_h", kAnyNumber, false));
  for (const double number : top.numbers("recording", {0, 1e6}, false)) {
    p.recording.push_back(static_cast<int>(number));
    if (p.recording.back() != number) top.fail("recording", fmt::format("found {}, expected integers", number));
  }
  p.gram = symmetric_of(top, "gram", top.numbers("gram", kAnyNumber, false));
  p.centres = centres_of(top, centres, info.inputs.size(), p.alpha.size());
  if (top.has("prior")) p.prior = read_prior(top.object("prior"));
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  return CompositeModel::make(std::move(info), std::move(p));
}

std::string composite_content(const Model& model) {
  const CompositeParameters& p = static_cast<const CompositeModel&>(model).parameters();
  std::string text = variances_text(p.variances);
  if (p.prior) text += prior_text(*p.prior);
  text += fmt::format("  \"trust\": {{\"skill\": {}, \"level\": {}, \"guard\": {}", exact_text(p.trust.skill),
                      exact_text(p.trust.level), exact_text(p.trust.guard));
  if (!p.trust.relevance.empty())
    text += fmt::format(", \"overlap\": {}, \"relevance\": {}", exact_text(p.trust.overlap),
                        exact_texts(p.trust.relevance));
  text += "},\n";
  text += fmt::format("  \"beta\": {},\n", exact_text(p.beta)) + normalisation_text(p.normalisation);
  append_rows(text, "centres", p.centres, p.centres.rows());
  append_rows(text, "alpha", p.alpha, 4);
  if (p.gram.size() > 0) {
    text += "  \"gram\": [\n" + triangle_text(p.gram) + "],\n";
    return text;
  }
  append_rows(text, "weight", p.weight, 4);
  append_rows(text, "time_h", p.time_h, 8);
  append_rows(text, "recording", Eigen::Map<const Eigen::VectorXi>(p.recording.data(), p.alpha.size()).cast<double>(),
              40);
  return text;
}

}  // namespace prism::compensation
