// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/recording_meanings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace prism::analysis {
namespace {

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  double width() const { return high > low ? high - low : 0; }
};

Range range_of(const std::vector<double>& values) {
  Range range;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range;
}

double mean_of_finite(const std::vector<double>& values) {
  double sum = 0, count = 0;
  for (const double value : values) {
    if (std::isfinite(value)) sum += value, ++count;
  }
  return count > 0 ? sum / count : 0;
}

struct KindDeviations {
  std::optional<double> soak, ramp;  // rms of deviations from the mean; unknown with fewer than two values
};

// Of the blocks that have a corrected value.
KindDeviations deviations(const std::vector<evaluation::ThermalKind>& kinds, const std::vector<double>& values,
                          const std::vector<double>& corrected) {
  std::vector<double> known, of_kind[2];  // soaks, ramps
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(corrected[i])) known.push_back(values[i]);
  }
  const double mean = mean_of_finite(known);
  for (std::size_t i = 0; i < std::min(kinds.size(), values.size()); ++i) {
    if (std::isfinite(corrected[i]))
      of_kind[kinds[i] != evaluation::ThermalKind::kSoak].push_back((values[i] - mean) * (values[i] - mean));
  }
  const auto rms = [](const std::vector<double>& squares) {
    return squares.size() < 2 ? std::optional<double>() : std::sqrt(mean_of_finite(squares));
  };
  return {rms(of_kind[0]), rms(of_kind[1])};
}

/// "1.5 h" or "400 s".
std::string duration_text(double seconds) {
  return seconds < 3600 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

std::string record_meaning(const recordings::BlockTable& table) {
  const Range t = range_of(table.column(compensation::kInputTemperature)),
              slope = range_of(table.column(compensation::kInputSlope)), bias = range_of(table.bias_deg_per_h);
  return fmt::format(
      "While the temperature went from {:.1f} to {:.1f} °C, at up to {:.2f} °C/min, the bias changed by {:.4g} deg/h "
      "(noise of a mean included).",
      t.low, t.high, 60 * std::max(std::abs(slope.low), std::abs(slope.high)), bias.width());
}

std::string stability_meaning(const evaluation::BiasStability& s, bool doubtful) {
  constexpr double kAlmostNoise = 1.1;
  if (!s.improvement) return "The raw bias is constant: there is nothing to remove.";
  if (*s.improvement <= 0)
    return fmt::format("With this model the rate is worse than without: do not use it for such recordings{}.",
                       doubtful ? ", unless the recording is at fault (see the warning)" : "");
  if (!s.floor_deg_per_h || !s.explained) return "The drift is hardly larger than the noise: little can be removed.";
  const double after = s.after.sd, floor = *s.floor_deg_per_h;
  if (after <= kAlmostNoise * floor)
    return fmt::format("What is left is almost only white noise ({:.5f} deg/h): no model could remove much more.",
                       floor);
  return fmt::format(
      "The model removes {:.1f} % of the drift's variance above the white noise ({:.5f} deg/h). The rest, {:.5f} "
      "deg/h, is {:.1f} times that noise: a better recording, more inputs or another model could remove more.",
      100 * std::min(*s.explained, 1.0), floor, after, after / floor);
}

std::string bias_meaning(const recordings::BlockTable& table, const std::vector<double>& corrected_deg_per_h) {
  const double mean = mean_of_finite(corrected_deg_per_h);
  double largest = 0, sum = 0, count = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < corrected_deg_per_h.size(); ++i) {
    if (!std::isfinite(corrected_deg_per_h[i])) continue;
    const double away = std::abs(corrected_deg_per_h[i] - mean);
    sum += away * away;
    ++count;
    if (away > largest) largest = away, at = i;
  }
  if (!(largest > 0)) return "The corrected bias is constant.";
  return fmt::format(
      "After the correction the largest deviation is {:.4g} deg/h ({:.1f} sigma), {:.1f} h after the start, at {:.1f} "
      "°C.",
      largest, largest / std::sqrt(sum / count), table.hours()[at], table.column(compensation::kInputTemperature)[at]);
}

std::string segments_meaning(const std::vector<evaluation::ThermalKind>& kinds,
                             const std::vector<double>& bias_deg_per_h, const std::vector<double>& corrected_deg_per_h,
                             double extrapolated_percent) {
  constexpr double kAlike = 1.25, kFew = 10;
  const KindDeviations before = deviations(kinds, bias_deg_per_h, corrected_deg_per_h),
                       after = deviations(kinds, corrected_deg_per_h, corrected_deg_per_h);
  if (!after.soak || !after.ramp)
    return fmt::format("The recording has only {}: it does not show how the model does in {}.",
                       after.soak ? "soaks" : "ramps", after.soak ? "ramps" : "soaks");
  const double soak = *after.soak, ramp = *after.ramp;
  const std::string conclusion =
      soak >= *before.soak && ramp >= *before.ramp ? "the model makes both worse"
      : extrapolated_percent > kFew
          ? fmt::format("{:.0f} % of the recording are outside the training, so this says little of the model",
                        extrapolated_percent)
      : ramp > kAlike * soak ? "the model is weaker while the temperature changes: train with more such ramps"
      : soak > kAlike * ramp ? "the model is weaker at constant temperature: drift in time, which no input shows"
                             : "the model is as good while the temperature changes as at rest";
  return fmt::format(
      "After the correction, deviations from the mean are {:.5f} deg/h (rms) in soaks and {:.5f} in ramps (before: "
      "{:.5f} and {:.5f}): {}.",
      soak, ramp, *before.soak, *before.ramp, conclusion);
}

std::string loop_meaning(const evaluation::Hysteresis& before, const evaluation::Hysteresis& after) {
  if (before.bins.empty() || after.bins.empty())
    return "No temperature was passed both heating and cooling, so the loop cannot be judged.";
  return fmt::format(
      "At the same temperature, heating and cooling differ by up to {:.4g} deg/h before and {:.4g} deg/h after.",
      before.max_gap_deg_per_h, after.max_gap_deg_per_h);
}

std::string hysteresis_meaning(const evaluation::Hysteresis& before, const evaluation::Hysteresis& after,
                               bool knows_slope) {
  if (!(before.max_gap_deg_per_h > 0)) return "Heating and cooling do not differ.";
  const double removed = 100 * (1 - after.max_gap_deg_per_h / before.max_gap_deg_per_h);
  if (removed <= 0)
    return knows_slope ? "The model does not reduce the difference between heating and cooling, although it has the "
                         "slope of temperature or a lag as input: in the training they differed in another way."
                       : "The model does not reduce the difference between heating and cooling: it needs dTdt or a lag "
                         "as input.";
  return fmt::format(
      "The model removes {:.0f} % of the largest difference between heating and cooling, and {:.0f} % of "
      "the area of the loop.",
      removed,
      before.loop_area_deg_per_h_degc > 0 ? 100 * (1 - after.loop_area_deg_per_h_degc / before.loop_area_deg_per_h_degc)
                                          : 0);
}

std::string allan_curve_meaning(const std::vector<double>& tau_s, const std::vector<double>& before,
                                const std::vector<double>& after) {
  constexpr double kVisible = 1.1;
  double best = 0, worst = std::numeric_limits<double>::infinity();
  std::size_t best_at = 0, worst_at = 0;
  double from = 0;  // the first averaging time from which on it helps; 0: none
  for (std::size_t i = 0; i < std::min({tau_s.size(), before.size(), after.size()}); ++i) {
    if (!(before[i] > 0 && after[i] > 0)) continue;
    const double ratio = before[i] / after[i];
    if (ratio > best) best = ratio, best_at = i;
    if (ratio < worst) worst = ratio, worst_at = i;
    if (ratio <= kVisible)
      from = 0;
    else if (from == 0)
      from = tau_s[i];
  }
  const auto change = [&](const char* what, std::size_t at) {
    return fmt::format("{} at averages of {}: {:.4g} instead of {:.4g} deg/h", what, duration_text(tau_s[at]),
                       after[at], before[at]);
  };
  std::string text;
  if (best > kVisible) text = change("The correction helps most", best_at);
  if (best > kVisible && from > tau_s.front())
    text += fmt::format("; in averages below {} the noise dominates, which no model removes", duration_text(from));
  if (worst * kVisible < 1)
    text += change(text.empty() ? "The correction makes the rate worse, most" : "; it makes it worse, most", worst_at);
  return text.empty() ? "The correction does not change the Allan deviation visibly: the noise dominates." : text + ".";
}

std::string allan_meaning(const evaluation::AllanCoefficients& before, const evaluation::AllanCoefficients& after) {
  constexpr double kSame = 0.05;
  const auto &n1 = coefficient(before, evaluation::NoiseType::kAngleRandomWalk).value,
             &n2 = coefficient(after, evaluation::NoiseType::kAngleRandomWalk).value;
  std::string text = "The angle random walk is not determined";
  if (n1 && n2) {
    const double change = *n2 / *n1 - 1;
    text = std::abs(change) <= kSame ? "The model adds no noise: the angle random walk stays the same"
                                     : fmt::format("The angle random walk {} by {:.0f} %",
                                                   change > 0 ? "rises" : "falls", 100 * std::abs(change));
  }
  const auto &b1 = coefficient(before, evaluation::NoiseType::kBiasInstability),
             &b2 = coefficient(after, evaluation::NoiseType::kBiasInstability);
  if (b1.value && b2.value)
    return text + fmt::format("; the bias instability changes from {:.3g} to {:.3g} deg/h.", *b1.value, *b2.value);
  if (b2.value)
    return text + fmt::format("; the bias instability of {:.3g} deg/h was there before, hidden by the thermal drift.",
                              *b2.value);
  return text + fmt::format("; the bias instability after the correction is at most {:.3g} deg/h.", b2.high);
}

std::string residual_meaning(const evaluation::Autocorrelation& residual, int block_s) {
  // Of the lags of white noise, 5 % are outside the band; twice that is hardly chance.
  constexpr double kByChance = 0.1;
  const std::vector<double>& r = residual.coefficient;
  if (r.size() < 2) return "The residual is too short for a conclusion.";
  const auto inside = [&](double value) { return std::abs(value) <= residual.band; };
  const auto outside = r.size() - 1 - static_cast<std::size_t>(std::count_if(r.begin() + 1, r.end(), inside));
  if (static_cast<double>(outside) <= kByChance * static_cast<double>(r.size() - 1))
    return fmt::format(
        "{} of {} lags are outside the lines, as with white noise: nothing is left that a model could "
        "remove.",
        outside, r.size() - 1);
  const auto end = std::find_if(r.begin() + 1, r.end(), inside);
  const double lags = static_cast<double>((end == r.end() ? r.end() - 1 : end) - r.begin());
  // White noise has no correlation with the next block, so the first coefficient is the drift's share.
  return fmt::format(
      "{} of {} lags are outside the lines: {} the residual is a drift that changes over {} {}, which the "
      "inputs do not show.",
      outside, r.size() - 1, r[1] > residual.band ? fmt::format("about {:.0f} % (variance) of", 100 * r[1]) : "part of",
      end == r.end() ? "more than" : "about", duration_text(lags * block_s));
}

std::string domain_meaning(std::size_t outside, std::size_t blocks) {
  constexpr double kFew = 0.03;
  if (outside == 0) return "The training covered all of this recording.";
  const double share = static_cast<double>(outside) / static_cast<double>(blocks);
  return fmt::format(
      "{:.1f} % of this recording are outside the training: {}.", 100 * share,
      share <= kFew ? "too little to matter" : "record a wider cycle, or do not judge the model by these");
}

}  // namespace prism::analysis
