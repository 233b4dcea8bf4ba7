// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "compensation/training/methods.hpp"
#include "compensation/training/summary.hpp"

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
  std::string kernel = fmt::format("c {}, sigma2 {}", plain_number(trained.c, 6), plain_number(trained.sigma2, 6));
  if (weights && settings.reweight.weight.has_parameter())
    kernel += fmt::format(", {} {}", settings.reweight.weight.kind == WeightKind::kHuber ? "beta" : "delta",
                          plain_number(trained.parameter, 4));
  std::string text = detail_line("kernel", kernel + " (inputs in units of their standard deviation)");
  text += detail_line("centres", fmt::format("{} samples that the model contains", trained.centres));
  if (trained.tuning) {
    const bool likelihood = settings.tuning == Tuning::kReml;
    text += detail_line(
        "cost", fmt::format("{}{} ({}, {} evaluations{})", plain_number(trained.tuning->best.cost, 6),
                            likelihood ? ": minus the log-likelihood of a sample"
                                       : " " + target_unit(trained) + ": mean absolute error on held-out samples",
                            tuning_text(settings.tuning), trained.tuning->evaluations,
                            trained.tuning->stopped ? ", stopped early" : ""));
  }
  if (trained.reweight && weights) {
    text += detail_line("outliers", fmt::format("{} rounds of weights, {} samples left out", trained.reweight->solves,
                                                trained.reweight->dropped));
  }
  return text;
}

}  // namespace

std::string detail_line(const std::string& name, const std::string& text) {
  return fmt::format("  {:<14} {}\n", name, text);
}

std::string target_unit(const TrainedModel& trained) {
  return trained.model->info().table ? "units of the target" : "deg/h";
}

std::string plain_number(double value, int digits) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  if (value == 0) return "0";
  if (std::abs(value) < 1e-7 || std::abs(value) > 1e9) return fmt::format("{:.{}g}", value, digits);
  const int power = static_cast<int>(std::floor(std::log10(std::abs(value)))), lost = power + 1 - digits;
  if (lost <= 0) return fmt::format("{:.{}f}", value, -lost);
  const double unit = std::pow(10, lost);
  return fmt::format("{:.0f}", unit * std::round(value / unit));
}

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
