// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "compensation/composite_model.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/training/methods.hpp"
#include "compensation/training/summary.hpp"

namespace prism::training {

// Variances in units of the target's variance.
MethodSummary describe_composite(const TrainedModel& trained, const TrainingSettings& settings,
                                 const std::vector<std::string>&) {
  const auto& p = static_cast<const compensation::CompositeModel&>(*trained.model).parameters();
  const compensation::CompositeVariances& v = p.variances;
  nlohmann::ordered_json json = {{"weight", weight_name(settings.reweight.weight.kind)}};
  json["variances"] = {{"smooth", v.kernel.rbf},
                       {"linear", v.kernel.linear},
                       {"quadratic", v.kernel.quadratic},
                       {"nuisance", v.nuisance},
                       {"nuisance_time_h", v.nuisance_time_h},
                       {"offset", v.offset},
                       {"noise", v.noise}};
  json["length_squared"] = std::vector<double>(v.kernel.length2.begin(), v.kernel.length2.end());
  json["skill"] = p.trust.skill;
  json["centres"] = trained.centres;
  json["reweighting"] = {{"solves", trained.reweight->solves}, {"converged", trained.reweight->converged}};
  const auto share = [](double variance) {
    return variance < 1e-3 ? std::string("0 %") : plain_number(100 * variance, 2) + " %";
  };
  constexpr double kConstant_h = 100;
  const std::string pace =
      v.nuisance_time_h > kConstant_h ? "slowly" : fmt::format("over {} h", plain_number(v.nuisance_time_h, 2));
  std::string text = detail_line(
      "skill",
      fmt::format("{:.2f}: how well each half of the recording predicts the other, 1 is perfectly; {:.2f} "
                  "with what one half cannot know. prismd uses the full prediction from {:g} on, only the mean "
                  "at {:g} or less",
                  p.trust.skill, compensation::evidence_of(p.trust.skill, p.trust.overlap), compensation::kFullSkill,
                  compensation::kNoSkill));
  text += detail_line("bias", fmt::format("shares of its variance: smooth {}, linear {}, quadratic {} in the inputs; "
                                          "drift in time {}, changing {}; noise {} (they may cancel each other, so one "
                                          "alone or the sum can exceed 100 %)",
                                          share(v.kernel.rbf), share(v.kernel.linear), share(v.kernel.quadratic),
                                          share(v.nuisance), pace, share(v.noise)));
  text +=
      detail_line("centres", fmt::format("{} samples that the model contains; {} rounds of weights against outliers",
                                         trained.centres, trained.reweight->solves));
  return {std::move(json), std::move(text)};
}

}  // namespace prism::training
