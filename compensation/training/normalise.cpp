// SPDX-License-Identifier: MIT
#include "compensation/training/normalise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace prism::training {
namespace {

struct Constants {
  double shift = 0, scale = 1;
};

// Sums in long double: the constants then do not depend on the order or the width of vectors.
Constants zscore(const Eigen::VectorXd& v, bool divisor_n) {
  long double sum = 0, squares = 0;
  for (const double value : v) sum += value;
  const long double n = static_cast<long double>(v.size()), mean = sum / n;
  for (const double value : v) squares += (value - mean) * (value - mean);
  return {static_cast<double>(mean), static_cast<double>(std::sqrt(squares / (divisor_n ? n : n - 1)))};
}

Constants automatic(const Eigen::VectorXd& v, bool divisor_n) {
  std::vector<double> sorted(v.data(), v.data() + v.size());
  std::sort(sorted.begin(), sorted.end());
  const double low = sorted.front(), high = sorted.back();
  const auto distinct = std::unique(sorted.begin(), sorted.end()) - sorted.begin();
  if (distinct == 2) return {(low + high) / 2, (high - low) / 2};
  if (static_cast<double>(distinct) < std::sqrt(static_cast<double>(v.size()))) return Constants{};
  return zscore(v, divisor_n);
}

Constants constants_of(const Eigen::VectorXd& v, NormalisationMethod scaling, bool target) {
  if (scaling == NormalisationMethod::kNone) return {};
  return scaling == NormalisationMethod::kAuto ? automatic(v, target) : zscore(v, target);
}

}  // namespace

Result<NormalisedData> normalise(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target,
                                 NormalisationMethod scaling, const std::vector<std::string>& names) {
  if (inputs.cols() < 2 || inputs.rows() < 1) {
    return make_error("training data", fmt::format("found {} samples of {} inputs, expected at least 2 of 1",
                                                   inputs.cols(), inputs.rows()));
  }
  if (!inputs.allFinite() || !target.allFinite())
    return make_error("training data", "found a number that is not finite");
  NormalisedData data;
  compensation::Normalisation& n = data.constants;
  n.input_shift.resize(inputs.rows());
  n.input_scale.resize(inputs.rows());
  for (Eigen::Index i = 0; i < inputs.rows(); ++i) {
    const Constants c = constants_of(inputs.row(i), scaling, false);
    // A column that repeats one decimal number has a standard deviation of rounding noise instead of zero.
    if (!(c.scale > 1e-14 * std::fabs(c.shift)) || !(c.scale > 0)) {
      return make_error(names[static_cast<std::size_t>(i)], "the input is constant, expected one that changes");
    }
    n.input_shift[i] = c.shift;
    n.input_scale[i] = c.scale;
  }
  const Constants t = constants_of(target, scaling, true);
  n.target_shift = t.shift;
  n.target_scale = t.scale > 0 ? t.scale : 1;
  data.x = normalised_inputs(inputs, n);
  data.y = (target.array() - n.target_shift) / n.target_scale;
  return data;
}

Eigen::MatrixXd normalised_inputs(const Eigen::MatrixXd& inputs, const compensation::Normalisation& constants) {
  return ((inputs.colwise() - constants.input_shift).array().colwise() / constants.input_scale.array()).matrix();
}

}  // namespace prism::training
