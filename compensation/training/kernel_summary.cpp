// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "compensation/training/methods.hpp"

namespace prism::training {
namespace {

nlohmann::ordered_json kernel_json(const TrainedModel& trained, const TrainingSettings& settings) {
  nlohmann::ordered_json json;
  if (settings.method->has(kWeights)) {
    json["weight"] = weight_name(settings.reweight.weight.kind);
    json["reweight"] = settings.reweight.limit == 1 ? "1" : "converge";
  }
  json["c"] = trained.c;
  json["sigma2"] = trained.sigma2;
  if (settings.reweight.weight.kind == WeightKind::kHuber) json["beta"] = trained.parameter;
  if (settings.reweight.weight.kind == WeightKind::kMyriad) json["delta"] = trained.parameter;
  json["cost"] = trained.tuning ? finite_json(trained.tuning->best.cost) : nlohmann::ordered_json(nullptr);
  json["centres"] = trained.centres;
  if (trained.reweight && settings.method->has(kWeights)) {
    const ReweightReport& r = *trained.reweight;
    json["reweighting"] = {{"solves", r.solves},
                           {"converged", r.converged},
                           {"oscillating", r.oscillating},
                           {"scale", finite_json(r.scale)},
                           {"dropped", r.dropped}};
  }
  if (!trained.tuning) return json;
  json["tuning"] = {{"evaluations", trained.tuning->evaluations},
                    {"stopped", trained.tuning->stopped},
                    {"surface", nlohmann::ordered_json::array()}};
  for (const TuningPoint& p : trained.tuning->surface) {
    json["tuning"]["surface"].push_back(
        {{"sigma2", p.sigma2}, {"c", p.c}, {"parameter", p.parameter}, {"cost", finite_json(p.cost)}});
  }
  return json;
}

std::string kernel_lines(const TrainedModel& trained, const TrainingSettings& settings) {
  const bool weights = settings.method->has(kWeights);
  std::string text = fmt::format("  c {:.6g}, sigma2 {:.6g}", trained.c, trained.sigma2);
  if (weights && settings.reweight.weight.has_parameter())
    text += fmt::format(", {} {:.4g}", settings.reweight.weight.kind == WeightKind::kHuber ? "beta" : "delta",
                        trained.parameter);
  text += fmt::format(", {} centres\n", trained.centres);
  if (trained.tuning) {
    text +=
        fmt::format("  cost {:.6g} ({}, {} evaluations{})\n", trained.tuning->best.cost, tuning_text(settings.tuning),
                    trained.tuning->evaluations, trained.tuning->stopped ? ", stopped early" : "");
  }
  if (trained.reweight && weights) {
    text += fmt::format("  {} re-weightings, scale {:.4g} (normalised), {} samples dropped\n", trained.reweight->solves,
                        trained.reweight->scale, trained.reweight->dropped);
  }
  return text;
}

}  // namespace

const char* tuning_text(Tuning tuning) {
  switch (tuning) {
    case Tuning::kBlocked:
      return "blocked folds";
    case Tuning::kShuffled:
      return "shuffled folds";
    case Tuning::kGiven:
      return "given folds";
    case Tuning::kLoo:
      return "leave-one-out";
    default:
      return "reml";
  }
}

MethodSummary describe_kernel(const TrainedModel& trained, const TrainingSettings& settings,
                              const std::vector<std::string>&) {
  return {kernel_json(trained, settings), kernel_lines(trained, settings)};
}

}  // namespace prism::training
