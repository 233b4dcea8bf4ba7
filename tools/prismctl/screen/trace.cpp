// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/trace.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "tools/prismctl/words.hpp"

namespace prism::screen {
namespace {

using nlohmann::json;
using prismctl::at;

constexpr double kDayS = 86400;
constexpr double kGapS = 10;  ///< the daemon's limit, after which it restarts the window

double number(const json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void Trace::push(const json& row, int window_s) {
  if (!at(row, "time_s").is_number()) return;
  const double time_s = at(row, "time_s").get<double>();
  while (!points_.empty() && points_.back().time_s >= time_s) points_.pop_back();
  if (points_.empty() || time_s - points_.back().time_s > kGapS || time_s < run_begin_s_) run_begin_s_ = time_s;
  while (!points_.empty() && points_.front().time_s < time_s - kDayS) points_.pop_front();
  // Without a model, rows do not show whether the window is full: use the time since the gap.
  const bool settled = at(row, "bias_deg_per_h").is_number() || time_s - run_begin_s_ >= window_s;
  points_.push_back(
      {time_s, number(at(row, "mean_rate_deg_per_h")), number(at(row, "corrected_mean_deg_per_h")), settled});
}

}  // namespace prism::screen
