// SPDX-License-Identifier: MIT
#include "compensation/evaluation/data_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/evaluation/bias_stability.hpp"

namespace prism::evaluation {
namespace {

/// Noise sds that no chance reaches in a day of blocks.
constexpr double kStandsOut = 8;
/// Blocks from which on steps and noise mean something.
constexpr std::size_t kEnoughForNoise = 8;

/// sd of the white part of blocks [begin, end): second differences have variance 6 sd², and neither a drift nor a ramp
/// reaches them; the median keeps outliers out.
double noise_of(std::span<const double> blocks, const std::vector<bool>& follows, std::size_t begin, std::size_t end) {
  std::vector<double> differences;
  for (std::size_t i = begin + 2; i < end; ++i) {
    if (!follows.empty() && (!follows[i] || !follows[i - 1])) continue;
    differences.push_back(blocks[i] - 2 * blocks[i - 1] + blocks[i - 2]);
  }
  return differences.empty() ? 0 : robust_sd(differences) / std::sqrt(6.0);
}

double median_between(std::span<const double> blocks, std::size_t begin, std::size_t end) {
  return median_of(
      {blocks.begin() + static_cast<std::ptrdiff_t>(begin), blocks.begin() + static_cast<std::ptrdiff_t>(end)});
}

/// |difference| between the medians of the `wide` blocks before the edge of block i and those after it; 0 at the ends.
double step_at(std::span<const double> blocks, std::size_t i, std::size_t wide) {
  if (i < wide || i + wide > blocks.size()) return 0;
  return std::abs(median_between(blocks, i, i + wide) - median_between(blocks, i - wide, i));
}

/// A step less the larger of the two next to it: a ramp of temperature steps everywhere alike and leaves nothing.
double lone_step(std::span<const double> blocks, std::size_t i, std::size_t wide, std::size_t apart) {
  const double before = i >= apart ? step_at(blocks, i - apart, wide) : 0;
  return step_at(blocks, i, wide) - std::max(before, step_at(blocks, i + apart, wide));
}

/// Largest step, deg/h, that is sharp (between two blocks, or within one of them) and lasts (medians of three blocks
/// on either side, which one outlier does not reach).
double largest_step(std::span<const double> blocks) {
  double largest = 0;
  for (std::size_t i = 3; i + 3 <= blocks.size(); ++i) {
    const double lasting = lone_step(blocks, i, 3, 6);
    if (lasting > largest) largest = std::max(largest, std::min(lasting, lone_step(blocks, i, 1, 2)));
  }
  return largest;
}

double disturbed_share(std::span<const double> blocks, double noise) {
  std::size_t disturbed = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::size_t begin = i < 3 ? 0 : i - 3, end = std::min(blocks.size(), i + 4);
    disturbed += std::abs(blocks[i] - median_between(blocks, begin, end)) > kStandsOut * noise;
  }
  return static_cast<double>(disturbed) / static_cast<double>(blocks.size());
}

/// Noisiest quarter over quietest.
double noise_ratio(std::span<const double> blocks, const std::vector<bool>& follows) {
  double low = HUGE_VAL, high = 0;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    const double noise = noise_of(blocks, follows, quarter * blocks.size() / 4, (quarter + 1) * blocks.size() / 4);
    low = std::min(low, noise);
    high = std::max(high, noise);
  }
  return low > 0 ? high / low : HUGE_VAL;
}

Verdict compare(double value, const Threshold& threshold, bool at_least) {
  const double sign = at_least ? 1 : -1;
  if (sign * value < sign * threshold.refuse) return Verdict::kRefuse;
  return sign * value < sign * threshold.warn ? Verdict::kWarn : Verdict::kPass;
}

/// One finding; `meaning` stands in the text when it is not passed.
Finding find(const char* name, double value, const char* unit, const Threshold& threshold, bool at_least,
             const char* meaning) {
  Finding finding{name, compare(value, threshold, at_least), value, unit, threshold, at_least, {}};
  finding.text =
      fmt::format("{:.4g}{}{}; wanted {} {:g}, refused {} {:g}", value, *unit ? " " : "", unit,
                  at_least ? "at least" : "at most", threshold.warn, at_least ? "below" : "above", threshold.refuse);
  if (finding.verdict != Verdict::kPass) finding.text += fmt::format(": {}", meaning);
  return finding;
}

}  // namespace

const char* verdict_text(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPass:
      return "pass";
    case Verdict::kWarn:
      return "warn";
    case Verdict::kRefuse:
      return "refuse";
  }
  return "";
}

Result<DataQuality> check_data_quality(std::span<const double> temperature_degc, std::span<const double> rate_deg_per_h,
                                       const std::vector<bool>& follows, const DataQualitySettings& settings,
                                       const std::string& where) {
  const std::size_t count = rate_deg_per_h.size();
  if (temperature_degc.size() != count || (!follows.empty() && follows.size() != count)) {
    return refuse(where, fmt::format("{} temperatures, {} rates; expected as many", temperature_degc.size(), count));
  }
  if (count < 2) return refuse(where, fmt::format("{} blocks; nothing can be said of fewer than 2", count));
  const auto temperature = summarise(temperature_degc, Divisor::kNMinus1, where + ", temperature");
  if (!temperature) return tl::unexpected(temperature.error());
  const auto rate = summarise(rate_deg_per_h, Divisor::kNMinus1, where + ", rate");
  if (!rate) return tl::unexpected(rate.error());

  const double span_degc = temperature->peak_to_peak;
  const double floor = noise_floor(rate_deg_per_h, follows).value_or(rate->sd);
  const double noise = noise_of(rate_deg_per_h, follows, 0, count);
  const double explainable = rate->sd > 0 ? std::max(0.0, 1 - floor * floor / (rate->sd * rate->sd)) : 0;
  const bool still = span_degc < settings.still_temperature_degc;

  DataQuality report;
  report.nothing_to_compensate = still || explainable < settings.min_explainable.refuse;
  auto& findings = report.findings;
  findings.push_back(find("temperature_span", span_degc, "degC", settings.min_temperature_span_degc, true,
                          "the model would know too little of the gyro's range"));
  findings.push_back(find("length", static_cast<double>(count), "blocks", settings.min_blocks, true, "too short"));
  findings.push_back(find("explainable", still ? 0 : explainable, "", settings.min_explainable, true,
                          still ? "the temperature stands still, so nothing can be blamed on it"
                                : "the rate hardly moves above its own noise"));
  if (count < kEnoughForNoise) {
    findings[1].text += "; its noise cannot be judged";
  } else if (noise > 0) {
    const double step = largest_step(rate_deg_per_h);
    findings.push_back(find("moved", step > kStandsOut * noise ? step / rate->sd : 0, "sd", settings.max_step, false,
                            "the earth rate in the record is not constant: was the gyro turned?"));
    findings.push_back(find("disturbed", disturbed_share(rate_deg_per_h, noise), "", settings.max_disturbed, false,
                            "many blocks stand out from their neighbours"));
    const double ratio = noise_ratio(rate_deg_per_h, follows);
    findings.push_back(find("noise", std::isfinite(ratio) ? ratio : 1e6, "x", settings.max_noise_ratio, false,
                            "the noise is not the same throughout"));
  } else {
    findings.push_back({"noise",
                        Verdict::kRefuse,
                        0,
                        "deg/h",
                        {},
                        false,
                        "0 deg/h: the rate has no noise at all; is it stuck, or coarsely rounded?"});
  }
  for (const Finding& finding : findings) report.verdict = std::max(report.verdict, finding.verdict);
  return report;
}

}  // namespace prism::evaluation
