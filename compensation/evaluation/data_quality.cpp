// SPDX-License-Identifier: MIT
#include "compensation/evaluation/data_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/irregularities.hpp"
#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

/// Deviation in noise sds that chance does not reach in a day of blocks.
constexpr double kStandsOut = 8;
/// Minimum number of blocks for steps and noise.
constexpr std::size_t kEnoughForNoise = 8;

// The thresholds of the findings.

constexpr Threshold kMinBlocks{200, 20};
constexpr Threshold kMinTemperatureSpan_degc{25, 10};  ///< a chamber cycle spans 60 or more
/// A record with a smaller temperature span contains no visible thermal drift.
constexpr double kStillTemperature_degc = 1;
/// Fraction of the variance of the blocks above their noise floor: 1 − floor² / sd². Without gross outliers.
constexpr Threshold kMinExplainable{0.5, 0.3};
/// Largest sharp and permanent step of at least eight noise sds, in sds of all blocks (a step alone is 2): the gyro
/// was moved, so that the Earth rate in the record changed. Not across a gap: drift may explain that, so it is warned
/// of at most, if it exceeds the drift next to the gap and elsewhere in the same time.
constexpr Threshold kMaxStep{0.25, 1};
/// Fraction of the blocks further than eight noise sds from their neighbours' median: shocks, people, trucks.
constexpr Threshold kMaxDisturbed{0.02, 0.10};
/// Fraction of the variance that gross outliers make: more than eight noise sds and five robust sds of all blocks
/// from their neighbours.
constexpr Threshold kMaxOutliers{0.5, 0.7};
/// Noise of the noisiest quarter of the record over that of the quietest (fewer parts if a quarter has fewer than 12
/// blocks); no noise counts as less than the quantiser's.
constexpr Threshold kMaxNoiseRatio{3, 10};

/// sd of the white part of blocks [begin, end): second differences have variance 6 sd² and do not depend on drift or
/// ramps; the median is robust against outliers.
double noise_of(std::span<const double> blocks, const std::vector<bool>& follows, std::size_t begin, std::size_t end) {
  std::vector<double> differences;
  for (std::size_t i = begin + 2; i < end; ++i) {
    if (!follows.empty() && (!follows[i] || !follows[i - 1])) continue;
    differences.push_back(blocks[i] - 2 * blocks[i - 1] + blocks[i - 2]);
  }
  return differences.empty() ? 0 : robust_sd(differences) / std::sqrt(6.0);
}

/// Distance of block i from the prediction of its neighbours: the median over straight lines through two of the three
/// blocks before and the three after it. A fast temperature ramp hardly bends any line; one bad neighbour is in fewer
/// than half of them.
double deviation_at(std::span<const double> blocks, std::size_t i) {
  constexpr std::array<std::pair<int, int>, 7> kPairs = {
      {{-1, -2}, {1, 2}, {-1, 1}, {-2, 2}, {-3, 3}, {-2, -3}, {2, 3}}};
  std::vector<double> deviations;
  for (const auto& [a, b] : kPairs) {
    const auto near = static_cast<std::ptrdiff_t>(i) + a, far = static_cast<std::ptrdiff_t>(i) + b;
    const auto size = static_cast<std::ptrdiff_t>(blocks.size());
    if (near < 0 || far < 0 || near >= size || far >= size) continue;
    const double line =
        (b * blocks[static_cast<std::size_t>(near)] - a * blocks[static_cast<std::size_t>(far)]) / (b - a);
    deviations.push_back(std::abs(blocks[i] - line));
  }
  return median_of(std::move(deviations));
}

/// deviation_at(), but small if the blocks of one side predict the block: it is next to a step, and no outlier.
double outlier_distance(std::span<const double> blocks, std::size_t i) {
  double distance = deviation_at(blocks, i);
  const auto line = [&](std::size_t near, std::size_t far, double ratio) {
    return std::abs(blocks[i] - blocks[near] - ratio * (blocks[near] - blocks[far]));
  };
  if (i >= 3) distance = std::min(distance, std::max(line(i - 1, i - 2, 1), line(i - 2, i - 3, 2)));
  if (i + 3 < blocks.size()) distance = std::min(distance, std::max(line(i + 1, i + 2, 1), line(i + 2, i + 3, 2)));
  return distance;
}

/// The blocks whose distance from their neighbours exceeds both the noise and the effect of the temperature's own
/// curvature there, with `sensitivity` deg/h per degC: where a chamber reverses, the rate also bends.
std::vector<std::size_t> disturbed_blocks(std::span<const double> blocks, std::span<const double> temperature_degc,
                                          double sensitivity, double noise) {
  std::vector<std::size_t> disturbed;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const double beyond_noise = outlier_distance(blocks, i) - kStandsOut * noise;
    if (!(beyond_noise > 0)) continue;
    double bend_degc = 0;
    for (std::size_t k = i - std::min<std::size_t>(i, 1); k < std::min(blocks.size(), i + 2); ++k)
      bend_degc = std::max(bend_degc, deviation_at(temperature_degc, k));
    if (beyond_noise > sensitivity * bend_degc) disturbed.push_back(i);
  }
  return disturbed;
}

/// Step of the quantiser, deg/h, if values repeat: their smallest difference. 0: the rate is not quantised.
double quantiser_step(std::span<const double> blocks) {
  std::vector<double> values(blocks.begin(), blocks.end());
  std::sort(values.begin(), values.end());
  const double rounding = 1e-9 * (values.back() - values.front());  // means of equal counts differ in their last bits
  double step = HUGE_VAL;
  std::size_t distinct = 1;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] - values[i - 1] <= rounding) continue;
    ++distinct;
    step = std::min(step, values[i] - values[i - 1]);
  }
  return distinct > 1 && 2 * distinct <= values.size() ? step : 0;
}

/// Noise ratio of the noisiest to the quietest of several equal parts of the record; no noise counts as less than
/// `least`. A part has at least kEnoughForPart blocks, so that a single bad row does not determine its noise.
struct NoiseRatio {
  double value = 0;
  std::size_t first = 0;  ///< block of the noisiest part
};

NoiseRatio noise_ratio(std::span<const double> blocks, const std::vector<bool>& follows, double least) {
  const std::size_t parts = std::min<std::size_t>(4, blocks.size() / kEnoughForPart);
  double low = HUGE_VAL, high = 0;
  NoiseRatio result;
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t begin = part * blocks.size() / parts, end = (part + 1) * blocks.size() / parts;
    const double noise = std::max(least, noise_of(blocks, follows, begin, end));
    low = std::min(low, noise);
    if (noise > high) high = noise, result.first = begin;
  }
  if (parts >= 2 && low > 0) result.value = high / low;
  return result;
}

Verdict compare(double value, const Threshold& threshold, bool at_least) {
  const double sign = at_least ? 1 : -1;
  if (sign * value < sign * threshold.reject) return Verdict::kRefuse;
  return sign * value < sign * threshold.warn ? Verdict::kWarn : Verdict::kPass;
}

/// One finding; its text contains `meaning` if it did not pass.
Finding find(const char* name, double value, const char* unit, const Threshold& threshold, bool at_least,
             const char* meaning) {
  Finding finding{name, compare(value, threshold, at_least), value, unit, threshold, at_least, {}};
  finding.text =
      fmt::format("{:.4g}{}{}; expected {} {:g}, rejected {} {:g}", value, *unit ? " " : "", unit,
                  at_least ? "at least" : "at most", threshold.warn, at_least ? "below" : "above", threshold.reject);
  if (finding.verdict != Verdict::kPass) finding.text += fmt::format(": {}", meaning);
  return finding;
}

/// The blocks that are not gross outliers.
struct Rest {
  std::vector<std::size_t> block, outliers;  ///< numbers of these blocks, and of the outliers
  std::vector<double> rate, temperature_degc;
  std::vector<bool> follows;
  std::vector<double> missing;  ///< blocks before each of them, outliers included
};

Rest rest_of(std::span<const double> rate, std::span<const double> temperature_degc, const Order& order,
             const std::vector<bool>& is_outlier) {
  Rest rest;
  const std::vector<bool>& follows = order.follows;
  double missing = 0;
  for (std::size_t i = 0; i < rate.size(); ++i) {
    if (i > 0) missing += order.missing.empty() ? (follows.empty() || follows[i] ? 0 : 1) : order.missing[i];
    if (is_outlier[i]) {
      rest.outliers.push_back(i);
      ++missing;
      continue;
    }
    rest.missing.push_back(std::exchange(missing, 0));
    rest.follows.push_back(i > 0 && !is_outlier[i - 1] && (follows.empty() || follows[i]));
    rest.block.push_back(i);
    rest.rate.push_back(rate[i]);
    rest.temperature_degc.push_back(temperature_degc[i]);
  }
  return rest;
}

/// Leaves out runs of far blocks: at most 5 % of the record, more only if no turn of the gyro explains them; then the
/// blocks further from their neighbours than `far`. Two bad blocks side by side shift the prediction for those next to
/// them, so each pass leaves out only the furthest within three blocks.
Rest without_outliers(std::span<const double> rate, std::span<const double> temperature_degc, const Order& order,
                      double far) {
  constexpr int kPasses = 8;
  constexpr double kAbsurd = 60;  // deg/h: four times the Earth rate
  std::vector<bool> is_outlier(rate.size(), false);
  for (const FarRun& run : far_runs(rate, {far, std::max(far, kAbsurd), rate.size() / 20, false}))
    std::fill_n(is_outlier.begin() + static_cast<std::ptrdiff_t>(run.begin), run.end - run.begin, true);
  Rest rest = rest_of(rate, temperature_degc, order, is_outlier);
  for (int pass = 0; pass < kPasses && far > 0 && 2 * rest.rate.size() > rate.size(); ++pass) {
    std::vector<double> deviations;
    for (std::size_t i = 0; i < rest.rate.size(); ++i) deviations.push_back(outlier_distance(rest.rate, i));
    bool any = false;
    for (std::size_t i = 0; i < deviations.size(); ++i) {
      if (deviations[i] <= far) continue;
      const auto begin = deviations.begin() + static_cast<std::ptrdiff_t>(i - std::min<std::size_t>(i, 3));
      const auto end = deviations.begin() + static_cast<std::ptrdiff_t>(std::min(deviations.size(), i + 4));
      if (*std::max_element(begin, end) > deviations[i]) continue;
      is_outlier[rest.block[i]] = any = true;
    }
    if (!any) break;
    rest = rest_of(rate, temperature_degc, order, is_outlier);
  }
  return rest;
}

/// Three times the sensitivity of the complete record per degree: a transient may be steeper than the soaks.
double sensitivity_of(std::span<const double> temperature_degc, double sd) {
  return 3 * sd / std::max(robust_sd({temperature_degc.begin(), temperature_degc.end()}), kStillTemperature_degc);
}

/// A step within the record; else one between the ends of a gap, which is a question.
void add_step_finding(const Rest& rest, double rest_sd, double noise, std::vector<Finding>& findings) {
  const std::vector<std::size_t> parts = parts_of(rest.missing);
  const Step step = largest_step(rest.rate, parts);
  const bool moved = step.size > kStandsOut * noise;
  findings.push_back(find("moved", moved ? step.size / rest_sd : 0, "sd", kMaxStep, false,
                          "the rate has a permanent step: was the gyro moved, or did its temperature jump?"));
  if (moved) findings.back().block = rest.block[step.block];
  if (findings.back().verdict != Verdict::kPass) return;
  const Step gap = largest_step_at_gaps(rest.rate, rest.missing, parts, kStandsOut * noise);
  if (gap.size / rest_sd <= kMaxStep.warn) return;
  const std::string question = fmt::format(
      "the rates before and after a gap of {:.0f} blocks differ by more than their drift: was the gyro moved "
      "meanwhile?",
      rest.missing[gap.block]);
  Finding& finding = findings.back();
  finding.verdict = Verdict::kWarn;
  finding.value = gap.size / rest_sd;
  finding.text = fmt::format("{:.4g} sd; expected at most {:g}: {}", finding.value, kMaxStep.warn, question);
  finding.block = rest.block[gap.block];
}

/// The noise and disturbance findings; `noise` of all blocks and of the `quantiser`, deg/h, the former > 0.
void add_noise_findings(std::span<const double> rate, const std::vector<bool>& follows, const Rest& rest, double sd,
                        double rest_sd, double noise, double quantiser, std::vector<Finding>& findings) {
  add_step_finding(rest, rest_sd, noise, findings);
  std::vector<std::size_t> disturbed = rest.outliers;
  for (const std::size_t i :
       disturbed_blocks(rest.rate, rest.temperature_degc, sensitivity_of(rest.temperature_degc, rest_sd), noise))
    disturbed.push_back(rest.block[i]);
  findings.push_back(find("disturbed", static_cast<double>(disturbed.size()) / static_cast<double>(rate.size()), "",
                          kMaxDisturbed, false, "many blocks differ from their neighbours"));
  if (!disturbed.empty()) findings.back().block = *std::min_element(disturbed.begin(), disturbed.end());
  const double share = rest.outliers.empty() ? 0 : 1 - rest_sd * rest_sd / (sd * sd);
  if (share > kMaxOutliers.warn) {
    const std::string meaning =
        fmt::format("share of the variance in {} far from the others, the first at {:.4g} deg/h",
                    counted(rest.outliers.size(), "block"), rate[rest.outliers.front()]);
    findings.push_back(find("outliers", share, "", kMaxOutliers, false, meaning.c_str()));
    findings.back().block = rest.outliers.front();
    while (findings.back().run < rest.outliers.size() &&
           rest.outliers[findings.back().run] == rest.outliers.front() + findings.back().run)
      ++findings.back().run;
  }
  const NoiseRatio ratio = noise_ratio(rate, follows, quantiser);
  if (ratio.value == 0) return;
  findings.push_back(find("noise", ratio.value, "x", kMaxNoiseRatio, false, "the noise changes during the record"));
  if (findings.back().verdict != Verdict::kPass) findings.back().block = ratio.first;
}

}  // namespace

const char* verdict_text(Verdict verdict) {
  constexpr const char* kTexts[] = {"pass", "warn", "refuse"};
  return kTexts[static_cast<std::size_t>(verdict)];
}

Result<DataQuality> check_data_quality(std::span<const double> temperature_degc, std::span<const double> rate_deg_per_h,
                                       const Order& order, const std::string& where, double rate_step_deg_per_h) {
  const std::size_t count = rate_deg_per_h.size();
  const std::vector<bool>& follows = order.follows;
  assert(temperature_degc.size() == count && (follows.empty() || follows.size() == count));
  if (count < 2) return make_error(where, fmt::format("found {} blocks, expected at least 2", count));
  const SummaryStatistics temperature = summarise(temperature_degc, Divisor::kNMinus1).value();
  const SummaryStatistics rate = summarise(rate_deg_per_h, Divisor::kNMinus1).value();
  const double span_degc = temperature.peak_to_peak;
  const double step = std::max(quantiser_step(rate_deg_per_h), rate_step_deg_per_h), quantiser = step / std::sqrt(12.0);
  const double any_noise = std::max(noise_of(rate_deg_per_h, follows, 0, count), quantiser);
  const double far = std::max(kStandsOut * any_noise, 5 * robust_sd({rate_deg_per_h.begin(), rate_deg_per_h.end()}));
  const Rest rest = without_outliers(rate_deg_per_h, temperature_degc, order, count < kEnoughForNoise ? 0 : far);
  // A constant run has none.
  const double noise = std::max(noise_of(rest.rate, rest.follows, 0, rest.rate.size()), quantiser);
  const SummaryStatistics rest_rate = summarise(rest.rate, Divisor::kNMinus1).value();
  const double floor = noise_floor(rest.rate, rest.follows).value_or(rest_rate.sd);
  const double explainable = rest_rate.sd > 0 ? std::max(0.0, 1 - floor * floor / (rest_rate.sd * rest_rate.sd)) : 0;
  const bool still = span_degc < kStillTemperature_degc;

  DataQuality report;
  report.constant_temperature = still;
  report.nothing_to_compensate = still || explainable < kMinExplainable.reject;
  auto& findings = report.findings;
  findings.push_back(find("temperature_span", span_degc, "degC", kMinTemperatureSpan_degc, true,
                          "too small for a model of the gyro's range"));
  findings.push_back(find("length", static_cast<double>(count), "blocks", kMinBlocks, true, "too short"));
  findings.push_back(find("explainable", still ? 0 : explainable, "", kMinExplainable, true,
                          still ? "the temperature is constant, so no drift can be attributed to it"
                                : "the rate hardly exceeds its own noise"));
  if (count < kEnoughForNoise) {
    findings[1].text += "; the noise cannot be evaluated";
  } else if (noise > 0) {
    add_noise_findings(rate_deg_per_h, follows, rest, rate.sd, rest_rate.sd, noise, quantiser, findings);
    if (step > noise) {  // a smaller step is below the noise
      findings.push_back({"quantised", step > rate.sd ? Verdict::kRefuse : Verdict::kWarn, step, "deg/h"});
      findings.back().text =
          fmt::format("{:.4g} deg/h; the rate changes in steps of this size, so smaller changes are not visible", step);
    }
  } else {
    findings.push_back({"noise", Verdict::kRefuse, 0, "deg/h"});
    findings.back().text = "0 deg/h: the rate has no noise; is the sensor stuck?";
  }
  for (const Finding& finding : findings) report.verdict = std::max(report.verdict, finding.verdict);
  return report;
}

}  // namespace prism::evaluation
