// SPDX-License-Identifier: MIT
#include "tools/prismcal/data_quality_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/leave_out.hpp"

namespace prism::analysis {

using report::Emphasis;

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
                                     {table.follows, std::move(missing)}, {}, table.name, table.rate_step_deg_per_h);
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

report::Paragraph data_quality_paragraph(const evaluation::DataQuality& quality, const std::string& recording) {
  const std::string error = data_quality_error(quality);
  if (!error.empty()) return {recording + ": " + error, Emphasis::kBad};
  if (quality.verdict == evaluation::Verdict::kWarn)
    return {recording + " can be used for training, with warnings.", Emphasis::kWarn};
  return {recording + " can be used for training.", Emphasis::kGood};
}

namespace {

/// A drift that the model with the other sign would remove.
std::string reversed_drift(const recordings::BlockTable& table, const ModelEvaluation& evaluated) {
  constexpr double kReversed = -0.6;
  const auto r = evaluation::correlate(evaluated.where_corrected(table.bias_deg_per_h),
                                       evaluated.where_corrected(evaluated.predicted_deg_per_h), table.name);
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
