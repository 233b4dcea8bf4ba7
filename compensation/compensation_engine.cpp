// SPDX-License-Identifier: MIT
#include "compensation/compensation_engine.hpp"

#include <cmath>
#include <utility>

namespace prism::compensation {

Result<void> CompensationEngine::use(ModelPtr model, ModelPtr fallback) {
  for (const ModelPtr& wanted : {model, fallback}) {
    if (wanted && wanted->info().table)
      return make_error("model", "trained on a CSV table, expected a model trained on recordings");
  }
  if (fallback) {
    for (const std::string& input : fallback->info().inputs) {
      if (input == kInputTemperature || input == kInputUhfo) continue;
      return make_error("fallback model",
                        "needs the input " + input + ", expected T and U only: it is used while the slope is unknown");
    }
  }
  if (model && !(model->info().features == extractor_.definition())) {
    extractor_ = FeatureExtractor(model->info().features);
    window_.reset();
  }
  model_ = std::move(model);
  fallback_ = std::move(fallback);
  break_off();  // the slew limit does not apply between models
  window_ ? void(correction_ = follow(*window_)) : forget_window();
  return {};
}

std::optional<CompensatedWindow> CompensationEngine::push(const Sample& sample, Compensated& out,
                                                          std::span<const double> values) {
  std::optional<CompensatedWindow> closed;
  const QuantitySet implausible = plausibility_.implausible(sample);
  if (const auto second_mean = averager_.push(sample, implausible, values)) {
    closed = complete(*second_mean);
    const std::int64_t step = second_number(sample.time_ns) - second_mean->second;
    if (step <= 0 || step - 1 > extractor_.definition().max_gap_s) forget_window();
  }
  out.sample = sample;
  out.correction = correction_;
  out.corrected_deg_per_h =
      implausible.rate || sample.clocks_differ ? kUnknown : corrected_rate(sample.rate_deg_per_h, correction_);
  if (!std::isfinite(sample.rate_deg_per_h)) out.correction.quality |= kRateInvalid;
  if (sample.clocks_differ) out.correction.quality |= kClocksDiffer;
  if (implausible.any()) {
    plausibility_.explain(sample, implausible, rejections_);
    out.correction.quality |= kImplausible;
  }
  return closed;
}

std::optional<CompensatedWindow> CompensationEngine::finish() {
  std::optional<CompensatedWindow> closed;
  if (const auto second_mean = averager_.finish()) closed = complete(*second_mean);
  forget_window();
  return closed;
}

void CompensationEngine::reset() {
  averager_ = SecondAverager(sensors_);
  plausibility_ = Plausibility(settings_.plausibility);
  rejections_ = {};
  extractor_.reset();
  forget_window();
}

void CompensationEngine::forget_window() {
  window_.reset();
  break_off();
  correction_ = {kUnknown, kUnknown, kUnknown, model_ ? kWarming : kNoModel};
}

// A second that a session boundary cuts is published with the bias in force and is part of no window.
CompensatedWindow CompensationEngine::complete(const SecondMean& second_mean) {
  CompensatedWindow row;
  row.window.second_mean = second_mean;
  if (!second_mean.partial) {
    row.window = extractor_.push(second_mean);
    correction_ = follow(row.window);
    window_ = row.window;
  }
  row.correction = correction_;
  row.corrected_deg_per_h = corrected_rate(without_implausible(second_mean).rate_deg_per_h, row.correction);
  row.corrected_mean_deg_per_h = corrected_rate(row.window.rate_deg_per_h, row.correction);
  if (!std::isfinite(second_mean.rate_deg_per_h)) row.correction.quality |= kRateInvalid;
  if (second_mean.clocks_differ) row.correction.quality |= kClocksDiffer;
  if (second_mean.implausible.any()) row.correction.quality |= kImplausible;
  row.rejections = std::exchange(rejections_, {});
  return row;
}

Correction CompensationEngine::follow(const Window& window) {
  Correction correction = correct(window);
  if (!std::isfinite(correction.bias_deg_per_h)) {
    break_off();
    return correction;
  }
  correction.offset_deg_per_h = offset_deg_per_h_;
  const Model& by = correction.quality & kFallback ? *fallback_ : *model_;
  const double most = greatest_slew_deg_per_h_per_s(by, settings_.slew, settings_.max_bias_deg_per_h);
  if (slew_.follow(correction.bias_deg_per_h, window.second_mean.second, by, most)) correction.quality |= kSlewLimited;
  return correction;
}

Correction CompensationEngine::correct(const Window& window) const {
  if (!model_) return {kUnknown, kUnknown, kUnknown, kNoModel};
  if (window.warm_s >= history_s(model_->info().features)) {
    Correction correction = predict(*model_, window);
    if (window.settling) correction.quality |= kSettling;
    return correction;
  }
  if (!fallback_) return {kUnknown, kUnknown, kUnknown, kWarming};
  Correction correction = predict(*fallback_, window);
  correction.quality |= kWarming | kFallback;
  return correction;
}

Correction CompensationEngine::predict(const Model& model, const Window& window) const {
  const std::vector<double> inputs = gather_inputs(model, window);
  if (inputs.empty()) return {kUnknown, kUnknown, kUnknown, kInputMissing};
  const Prediction prediction = predict_within(model, inputs, settings_.extrapolation);
  if (!(std::fabs(prediction.bias_deg_per_h) <= settings_.max_bias_deg_per_h))
    return {kUnknown, kUnknown, kUnknown, kOverLimit};
  return {prediction.bias_deg_per_h, prediction.sd_deg_per_h, prediction.sd_mean_deg_per_h,
          prediction.extrapolating ? kExtrapolating : kGood};
}

}  // namespace prism::compensation
