// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/recording_doubts.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/evaluation/correlation.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"

namespace prism::analysis {
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
    for (std::string& text : disturbances(*quality)) add(std::move(text));
  }
  add(reversed_drift(table, evaluated));
  add(other_mean(table, evaluated));
  return doubts;
}

}  // namespace prism::analysis
