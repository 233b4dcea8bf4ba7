// SPDX-License-Identifier: MIT
#include "compensation/slew_limit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace prism::compensation {

double greatest_slew_deg_per_h_per_s(const Model& model, const SlewSettings& settings, double max_bias_deg_per_h) {
  if (!settings.limited) return std::numeric_limits<double>::infinity();
  if (settings.max_slew_deg_per_h_per_s) return *settings.max_slew_deg_per_h_per_s;
  const double own = model.bias_span_deg_per_h();
  const double span = std::isfinite(own) ? std::min(own, 2 * max_bias_deg_per_h) : 2 * max_bias_deg_per_h;
  return std::max(kLeastSlew, kSlewMargin * span / model.info().features.length_s);
}

bool SlewLimit::follow(double& bias_deg_per_h, std::int64_t second, const Model& by, double most_deg_per_h_per_s) {
  const double wanted = bias_deg_per_h;
  const double most = most_deg_per_h_per_s * static_cast<double>(second - second_);
  if (by_ == &by && most > 0 && std::isfinite(most))
    bias_deg_per_h = std::clamp(wanted, bias_deg_per_h_ - most, bias_deg_per_h_ + most);
  by_ = &by;
  bias_deg_per_h_ = bias_deg_per_h;
  second_ = second;
  return bias_deg_per_h != wanted;
}

}  // namespace prism::compensation
