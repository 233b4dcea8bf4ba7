// SPDX-License-Identifier: MIT
#include "tools/prismcal/model_evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "compensation/earth_rate.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/extrapolation.hpp"
#include "tools/prismcal/findings.hpp"

namespace prism::analysis {
namespace {

using compensation::Correction;

/// The corrections of the seconds whose window is not ready.
std::vector<double> follow_warming(compensation::CompensationEngine& engine, const recordings::BlockTable& table) {
  std::vector<double> biases;
  biases.reserve(table.warming.size());
  engine.break_off();
  for (std::size_t i = 0; i < table.warming.size(); ++i) {
    const compensation::Window& window = table.warming[i];
    if (window.warm_s == 1) engine.break_off();
    biases.push_back(engine.follow(window).bias_deg_per_h);
  }
  return biases;
}

/// Counts the blocks within two of the model's standard deviation of a block mean (with noise), and finds how their
/// errors changed since the training. Returns the mean of the training at the first of them; kUnknown: not in the
/// model.
double count_coverage(const compensation::Model& model, const recordings::BlockTable& table,
                      const CorrectionSettings& settings, ModelEvaluation& result) {
  double training_mean = kUnknown;
  std::vector<double> time_s, error, sd, sd_mean;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!std::isfinite(result.corrected_deg_per_h[i])) continue;
    const auto inputs = compensation::gather_inputs(model, table.blocks[i]);
    const auto prediction = compensation::predict_within(model, inputs, settings.engine.extrapolation);
    if (std::isnan(training_mean)) training_mean = prediction.mean_deg_per_h;
    if (!std::isfinite(prediction.sd_mean_deg_per_h)) continue;
    ++result.with_sd;
    result.within_two_sd +=
        std::abs(table.bias_deg_per_h[i] - prediction.bias_deg_per_h) <= 2 * prediction.sd_mean_deg_per_h;
    time_s.push_back(static_cast<double>(table.second(i)));
    error.push_back(table.bias_deg_per_h[i] - prediction.bias_deg_per_h);
    sd.push_back(prediction.sd_deg_per_h), sd_mean.push_back(prediction.sd_mean_deg_per_h);
  }
  const double mount_sd = compensation::mount_sd_deg_per_h(table.earth_rate_deg_per_h, settings.direction_rad);
  if (!error.empty()) result.change = evaluation::bias_change(time_s, error, sd, sd_mean, mount_sd);
  return training_mean;
}

std::optional<double> rms_improvement(const recordings::BlockTable& table, const ModelEvaluation& result,
                                      double training_mean) {
  if (!std::isfinite(training_mean)) return std::nullopt;
  std::vector<double> before = result.where_corrected(table.bias_deg_per_h);
  for (double& bias : before) bias -= training_mean;
  const auto summary = evaluation::summarise(before, evaluation::Divisor::kN);
  if (!summary || !(summary->rms > 0)) return std::nullopt;
  return 1 - result.stability.after.rms / summary->rms;
}

/// The input of the model that a block lacks.
std::string missing_input(const compensation::Model& model, const recordings::BlockTable& table, std::size_t block) {
  const compensation::ModelInfo& info = model.info();
  const auto unknown = std::find_if_not(info.inputs.begin(), info.inputs.end(), [&](const std::string& name) {
    return std::isfinite(compensation::input_value(table.blocks[block], info.features, name));
  });
  return unknown == info.inputs.end() ? "" : *unknown;
}

/// Fewer than two blocks have a correction.
tl::unexpected<Error> too_few(const compensation::Model& model, const recordings::BlockTable& table,
                              const ModelEvaluation& result, double max_bias_deg_per_h) {
  const std::string& name = model.info().name;
  if (result.uncorrected == 0)
    return make_error(table.name, fmt::format("found {} of {} s, expected 2 or more", counted(table.size(), "block"),
                                              table.features.length_s));
  if (result.without_input > 0)
    return make_error(table.name, fmt::format("input {} of model \"{}\" is unknown in {} of {} blocks; expected it, or "
                                              "a model without it (prismcal train --inputs)",
                                              result.missing_input, name, result.without_input, table.size()));
  return make_error(table.name,
                    fmt::format("the bias of model \"{}\" is above {:g} deg/h in {} of {} blocks: prismd would "
                                "not publish corrected rates; set the limit with --max-bias or --config",
                                name, max_bias_deg_per_h, result.uncorrected, table.size()));
}

evaluation::BiasStability stability_of(const ModelEvaluation& result, const recordings::BlockTable& table,
                                       evaluation::Divisor divisor) {
  std::vector<bool> follows = table.follows;
  for (std::size_t i = 1; i < follows.size(); ++i)
    follows[i] = follows[i] && std::isfinite(result.corrected_deg_per_h[i - 1]);
  return evaluation::measure_bias_stability(result.where_corrected(table.bias_deg_per_h),
                                            result.where_corrected(result.corrected_deg_per_h),
                                            result.where_corrected(follows), divisor);
}

}  // namespace

std::string CorrectionSettings::text() const {
  const compensation::SlewSettings& slew = engine.slew;
  return fmt::format("bias limit: {:g} deg/h; extrapolation: {}; slew limit: {}; fallback model: {}",
                     engine.max_bias_deg_per_h, compensation::extrapolation_name(engine.extrapolation),
                     !slew.limited ? "none"
                     : slew.max_slew_deg_per_h_per_s
                         ? fmt::format("{:g} deg/h per second", *slew.max_slew_deg_per_h_per_s)
                         : "from the model's training range",
                     fallback ? fallback->info().name : "none");
}

std::vector<recordings::Series> ModelEvaluation::corrected_seconds_deg_per_h(
    const recordings::BlockTable& table) const {
  std::vector<recordings::Series> corrected;
  std::size_t block = 0, warming = 0;
  recordings::for_each_known(table.seconds, [&](std::int64_t second, double rate) {
    while (block < table.size() && table.second(block) < second) ++block;
    while (warming < table.warming.size() && table.warming[warming].second_mean.second < second) ++warming;
    Correction correction;
    if (block < table.size() && second > table.second(block) - table.features.length_s)
      correction.bias_deg_per_h = predicted_deg_per_h[block];
    if (warming < table.warming.size() && table.warming[warming].second_mean.second == second)
      correction.bias_deg_per_h = predicted_warming_deg_per_h[warming];
    recordings::append(corrected, second, compensation::corrected_rate(rate, correction));
  });
  return corrected;
}

Result<ModelEvaluation> evaluate_model(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                       const CorrectionSettings& settings, evaluation::Divisor divisor) {
  const compensation::ModelInfo& info = model->info();
  if (!(info.features == table.features)) {
    return make_error(table.name, fmt::format("found blocks with other features than model \"{}\"", info.name));
  }
  compensation::CompensationEngine engine(settings.engine);
  if (auto used = engine.use(model, settings.fallback); !used) return tl::unexpected(used.error());
  ModelEvaluation result;
  result.knows_slope = std::ranges::any_of(info.inputs, compensation::is_slope);
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!table.follows[i]) engine.break_off();
    const Correction correction = engine.follow(table.blocks[i]);
    if ((correction.quality & compensation::kInputMissing) && result.without_input++ == 0)
      result.missing_input = missing_input(*model, table, i);
    result.predicted_deg_per_h.push_back(correction.bias_deg_per_h);
    result.corrected_deg_per_h.push_back(compensation::corrected_rate(table.bias_deg_per_h[i], correction));
    result.extrapolating.push_back((correction.quality & compensation::kExtrapolating) != 0);
    result.extrapolated += result.extrapolating.back();
    result.slew_limited += (correction.quality & compensation::kSlewLimited) != 0;
    result.uncorrected += !std::isfinite(correction.bias_deg_per_h);
  }
  if (table.size() < result.uncorrected + 2) return too_few(*model, table, result, settings.engine.max_bias_deg_per_h);
  result.predicted_warming_deg_per_h = follow_warming(engine, table);
  result.stability = stability_of(result, table, divisor);
  result.rms_improvement = rms_improvement(table, result, count_coverage(*model, table, settings, result));
  result.improvement_interval = evaluation::next_improvement(result.where_corrected(table.bias_deg_per_h),
                                                             result.where_corrected(result.corrected_deg_per_h));
  return result;
}

std::string interval_text(const std::optional<evaluation::Estimate>& interval) {
  return interval ? fmt::format("{:.1f} to {:.1f}", 100 * interval->low, 100 * interval->high) : report::kNothing;
}

std::optional<evaluation::Estimate> gain_of(const ModelEvaluation& first, const ModelEvaluation& other,
                                            const recordings::BlockTable& table) {
  std::vector<double> before, one, two;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!std::isfinite(first.corrected_deg_per_h[i]) || !std::isfinite(other.corrected_deg_per_h[i])) continue;
    before.push_back(table.bias_deg_per_h[i]);
    one.push_back(first.corrected_deg_per_h[i]);
    two.push_back(other.corrected_deg_per_h[i]);
  }
  const auto gain = evaluation::next_difference(before, one, two);
  if (!gain) return std::nullopt;
  return evaluation::Estimate{100 * gain->value, 100 * gain->low, 100 * gain->high};
}

namespace {

bool is_disturbance(const std::string& name) { return name == "moved" || name == "disturbed" || name == "outliers"; }

/// A disturbance of the rate refuses the recording.
bool is_disturbed(const evaluation::DataQuality& quality) {
  return std::ranges::any_of(quality.findings, [](const evaluation::Finding& finding) {
    return finding.verdict == evaluation::Verdict::kRefuse && is_disturbance(finding.name);
  });
}

/// The place of the first block of a finding; of outliers with the option that leaves them out.
std::string place_text(const recordings::BlockTable& table, double hours, const evaluation::Finding& finding) {
  constexpr std::int64_t kDates = 100'000'000;  // seconds since 1970: later than 1973
  std::string text = fmt::format(" (first at block {}, which ends {:.2f} h after the start", *finding.block + 1, hours);
  const std::int64_t first = table.second(*finding.block) - table.features.length_s + 1,
                     last = table.second(*finding.block + finding.run - 1);
  const auto time = [](std::int64_t second) {
    return second < kDates ? fmt::format("{}", second + 1) : recordings::end_of_second(second, true);
  };
  if (finding.name == "outliers")
    text += fmt::format("; --leave-out {}..{} leaves {} out", time(first), time(last), finding.run > 1 ? "them" : "it");
  if (finding.name == "moved") {
    // The end of the block before may already belong to the new place. Before a gap it does not matter.
    const bool after_gap = *finding.block == 0 || !table.follows[*finding.block];
    text += after_gap ? fmt::format("; --leave-out {}.. leaves out this and what follows", time(first))
                      : fmt::format(
                            "; the step may be in the block before: --leave-out {}.. leaves out that one and "
                            "what follows",
                            time(first - table.features.length_s));
  }
  return text + ")";
}

}  // namespace

Result<evaluation::DataQuality> check_blocks(const recordings::BlockTable& table) {
  const std::vector<double> hours = table.hours();
  std::vector<double> missing(table.size());
  for (std::size_t i = 1; i < table.size(); ++i)
    missing[i] = (hours[i] - hours[i - 1]) * 3600 / table.features.length_s - 1;
  auto quality =
      evaluation::check_data_quality(table.column(compensation::kInputTemperature), table.bias_deg_per_h,
                                     {table.follows, std::move(missing)}, table.name, table.rate_step_deg_per_h);
  if (!quality) return quality;
  quality->cause = table.spikes;
  for (evaluation::Finding& finding : quality->findings) {
    if (finding.block && finding.verdict != evaluation::Verdict::kPass)
      finding.text += place_text(table, hours[*finding.block], finding);
  }
  return quality;
}

nlohmann::ordered_json data_quality_json(const evaluation::DataQuality& quality) {
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const evaluation::Finding& f : quality.findings) {
    findings.push_back({{"name", f.name},
                        {"verdict", evaluation::verdict_text(f.verdict)},
                        {"value", f.value},
                        {"unit", f.unit},
                        {f.at_least ? "warn_below" : "warn_above", f.threshold.warn},
                        {f.at_least ? "refuse_below" : "refuse_above", f.threshold.reject}});
  }
  return {{"verdict", evaluation::verdict_text(quality.verdict)},
          {"nothing_to_compensate", quality.nothing_to_compensate},
          {"findings", findings}};
}

std::string data_quality_words(const evaluation::DataQuality& quality) {
  std::string problems;
  for (const evaluation::Finding& finding : quality.findings) {
    if (finding.verdict == evaluation::Verdict::kPass) continue;
    problems += fmt::format("{}{} {:.3g}{}{}", problems.empty() ? "" : "; ", finding.name, finding.value,
                            finding.unit.empty() ? "" : " ", finding.unit);
    if (finding.threshold.warn != 0)
      problems += fmt::format(", expected {} {:g}", finding.at_least ? "at least" : "at most", finding.threshold.warn);
  }
  const std::string verdict = evaluation::verdict_text(quality.verdict);
  return problems.empty() ? verdict : fmt::format("{} ({})", verdict, problems);
}

std::string data_quality_error(const evaluation::DataQuality& quality) {
  const bool disturbed = is_disturbed(quality);
  const bool nothing = (quality.constant_temperature || quality.nothing_to_compensate) && !disturbed;
  if (nothing && !quality.cause.empty()) return "nothing to compensate: " + quality.cause;
  if (quality.constant_temperature && !disturbed)
    return fmt::format("nothing to compensate: the temperature changes by {:.3g} degC{}", quality.findings[0].value,
                       quality.findings[0].value == 0 ? "; has its sensor stopped?" : ".");
  if (nothing) return "nothing to compensate: changes of the bias with temperature are within its noise.";
  if (quality.verdict != evaluation::Verdict::kRefuse) return {};
  std::vector<evaluation::Finding> findings = quality.findings;  // a disturbance may be the reason of the others
  std::stable_partition(findings.begin(), findings.end(), [](const auto& f) { return is_disturbance(f.name); });
  std::string why;
  for (const evaluation::Finding& finding : findings) {
    if (finding.verdict == evaluation::Verdict::kRefuse)
      why += fmt::format("{}{} {}", why.empty() ? "" : "; ", finding.name, finding.text);
  }
  return fmt::format("not usable for training: {}.", why);
}

Usability usability_of(const recordings::Loaded& loaded, bool to_train) {
  Usability found{check_blocks(loaded.table), ""};
  const recordings::BlockTable& table = loaded.table;
  if (const auto sign = recordings::sign_question(table.mean_rate_deg_per_h(), table.earth_rate_deg_per_h))
    found.reason = sign->text;
  if (!found.quality) found.reason = found.quality.error().what;
  if (!found.reason.empty() || (!to_train && found.quality->cause.empty() && !is_disturbed(*found.quality)))
    return found;
  const std::string error = data_quality_error(*found.quality);
  for (const recordings::Finding& finding : loaded.recording.findings) {
    const bool left_out = finding.kind == "far" || finding.kind == "constant" || finding.kind == "implausible";
    if (left_out && !error.empty() && !finding.text.empty()) found.reason += finding.line() + "; ";
  }
  found.reason += error;
  return found;
}

namespace {

/// A drift that the model with the other sign would remove.
std::string reversed_drift(const recordings::BlockTable& table, const ModelEvaluation& evaluated) {
  constexpr double kReversed = -0.6;
  const auto r = evaluation::correlate(evaluated.where_corrected(table.bias_deg_per_h),
                                       evaluated.where_corrected(evaluated.predicted_deg_per_h));
  if (!r || *r > kReversed) return {};
  return fmt::format(
      "its drift is the opposite of the model's (correlation {:.2f}): has its rate or that of the training the wrong "
      "sign?",
      *r);
}

/// A mean bias that the model does not explain, and what would.
std::string other_mean(const recordings::BlockTable& table, const ModelEvaluation& evaluated) {
  constexpr double kFar = 20, kLeast = 0.5;  // sd of the bias, deg/h: no turn-on offset
  constexpr double kNear = 0.1;              // of the Earth rate
  const evaluation::BiasStability& s = evaluated.stability;
  const double mean = s.before.mean, model = mean - s.after.mean, earth = table.earth_rate_deg_per_h;
  if (std::abs(s.after.mean) < std::max(kLeast, kFar * s.before.sd)) return {};
  const double other_rate = -mean - 2 * earth, other_earth = mean + 2 * earth;
  const auto near = [&](double bias) { return std::abs(bias - model) < kNear * std::abs(earth); };
  const std::string text = fmt::format("its mean bias is {:.4g} deg/h, that of the model {:.4g} deg/h", mean, model);
  if (near(other_rate) || near(other_earth))
    return text + fmt::format(
                      "; with the other sign of the rate it would be {:.4g}, with that of the Earth rate "
                      "(elevation) {:.4g}: is one of them wrong?",
                      other_rate, other_earth);
  return text + ": are Earth rate (latitude, elevation, azimuth), unit and sign those of the training?";
}

}  // namespace

std::vector<std::string> recording_doubts(const recordings::BlockTable& table, const ModelEvaluation& evaluated,
                                          const std::vector<std::string>& questions) {
  std::vector<std::string> doubts = questions;
  const auto add = [&](std::string text) {
    if (!text.empty()) doubts.push_back(std::move(text));
  };
  if (const auto quality = check_blocks(table)) {
    for (const evaluation::Finding& finding : quality->findings) {
      if (finding.verdict != evaluation::Verdict::kPass && is_disturbance(finding.name))
        doubts.push_back(finding.name + " " + finding.text);
    }
  }
  add(reversed_drift(table, evaluated));
  add(other_mean(table, evaluated));
  return doubts;
}

}  // namespace prism::analysis
