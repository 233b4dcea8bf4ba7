// SPDX-License-Identifier: MIT
#include "compensation/training/quasi_newton.hpp"

#include <algorithm>
#include <cmath>

namespace prism::training {

QuasiNewtonResult minimise_smooth(const SmoothFunction& f, const Eigen::VectorXd& start,
                                  const QuasiNewtonSettings& settings, const std::function<bool()>& stop) {
  constexpr double kArmijo = 1e-4, kShortest = 1e-8;
  const Eigen::Index n = start.size();
  const bool informed = settings.inverse_hessian.size() > 0;
  QuasiNewtonResult best{start, 0, 1, informed ? settings.inverse_hessian : Eigen::MatrixXd::Identity(n, n)};
  Eigen::VectorXd gradient(n), next_gradient(n);
  best.value = f(best.x, gradient);
  Eigen::MatrixXd& inverse = best.inverse_hessian;
  bool fresh = !informed;  // the Hessian is an initial guess
  while (std::isfinite(best.value) && gradient.cwiseAbs().maxCoeff() > settings.g_tolerance && !stop()) {
    Eigen::VectorXd step = -inverse * gradient;
    if (!(step.dot(gradient) < 0)) {
      inverse.setIdentity();
      fresh = true;
      step = -gradient;
    }
    if (const double longest = step.cwiseAbs().maxCoeff(); longest > settings.max_step)
      step *= settings.max_step / longest;
    const double slope = step.dot(gradient);
    double length = 1, value = 0;
    for (;; length = std::clamp(-slope * length * length / (2 * (value - best.value - slope * length)), 0.1 * length,
                                0.5 * length)) {
      if (best.evaluations >= settings.max_evaluations || length < kShortest) return best;
      value = f(best.x + length * step, next_gradient);
      ++best.evaluations;
      if (!std::isfinite(value)) value = best.value + std::abs(best.value) + 1;
      if (value <= best.value + kArmijo * length * slope) break;
    }
    const Eigen::VectorXd s = length * step, y = next_gradient - gradient;
    const double curvature = s.dot(y), won = best.value - value;
    best.x += s;
    best.value = value;
    gradient = next_gradient;
    if (curvature > 1e-10 * s.norm() * y.norm()) {
      if (fresh) inverse *= curvature / y.squaredNorm();
      fresh = false;
      const Eigen::VectorXd hy = inverse * y;
      inverse += (1 + y.dot(hy) / curvature) / curvature * (s * s.transpose()) -
                 (hy * s.transpose() + s * hy.transpose()) / curvature;
    }
    if (won < settings.f_tolerance) break;
  }
  return best;
}

}  // namespace prism::training
