// SPDX-License-Identifier: MIT
#include "compensation/training/nuisance_filter.hpp"

#include <cmath>

namespace prism::training {

NuisanceFilter::NuisanceFilter(const compensation::CompositeVariances& v, const Eigen::VectorXd& time_h,
                               const std::vector<int>& recording, const Eigen::VectorXd& weight)
    : steps_(recording.size()) {
  Eigen::Matrix2d p = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    Step& step = steps_[k];
    const auto i = static_cast<Eigen::Index>(k);
    step.fresh = k == 0 || recording[k] != recording[k - 1];
    if (step.fresh) {
      p << v.nuisance, 0, 0, v.offset;
    } else {
      step.kept = std::exp(-std::abs(time_h[i] - time_h[i - 1]) / v.nuisance_time_h);
      p(0, 0) = step.kept * step.kept * p(0, 0) + v.nuisance * (1 - step.kept * step.kept);
      p(0, 1) = p(1, 0) = step.kept * p(0, 1);
    }
    const Eigen::Vector2d seen = p.rowwise().sum();
    step.variance = seen.sum() + v.noise / weight[i] + compensation::kCompositeJitter;
    step.gain_nuisance = seen[0] / step.variance;
    step.gain_offset = seen[1] / step.variance;
    p -= seen * seen.transpose() / step.variance;
  }
}

void NuisanceFilter::whiten(Eigen::MatrixXd& values, Eigen::Index first, Carry& carry) const {
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    const Step& step = steps_[static_cast<std::size_t>(first + j)];
    auto column = values.col(j);
    carry.nuisance *= step.kept;
    if (step.fresh) carry.offset.setZero();
    column -= carry.nuisance + carry.offset;
    carry.nuisance += step.gain_nuisance * column;
    carry.offset += step.gain_offset * column;
    column /= std::sqrt(step.variance);
  }
}

Eigen::VectorXd NuisanceFilter::solve(const Eigen::VectorXd& y) const {
  Eigen::VectorXd result(y.size());
  double nuisance = 0, offset = 0;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    const Step& step = steps_[k];
    nuisance *= step.kept;
    if (step.fresh) offset = 0;
    const double innovation = y[static_cast<Eigen::Index>(k)] - nuisance - offset;
    nuisance += step.gain_nuisance * innovation;
    offset += step.gain_offset * innovation;
    result[static_cast<Eigen::Index>(k)] = innovation / step.variance;
  }
  // Backwards: u_k = e_k/F_k − gainᵀ Tᵀ r_k, r_{k−1} = 1 u_k + Tᵀ r_k, T = diag(kept, 1) to the next sample.
  double r_nuisance = 0, r_offset = 0;
  for (std::size_t k = steps_.size(); k-- > 0;) {
    const bool last = k + 1 == steps_.size() || steps_[k + 1].fresh;
    r_nuisance = last ? 0 : steps_[k + 1].kept * r_nuisance;
    r_offset = last ? 0 : r_offset;
    double& u = result[static_cast<Eigen::Index>(k)];
    u -= steps_[k].gain_nuisance * r_nuisance + steps_[k].gain_offset * r_offset;
    r_nuisance += u;
    r_offset += u;
  }
  return result;
}

}  // namespace prism::training
