// SPDX-License-Identifier: MIT
#include "compensation/training/minimise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace prism::training {
Minimum minimise(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                 const SimplexSettings& settings, const std::function<bool()>& stop) {
  std::vector<Minimum> vertices;
  int evaluations = 0;
  const auto at = [&](const Eigen::VectorXd& x) -> Minimum {
    const Eigen::VectorXd inside = x.cwiseMax(settings.lower).cwiseMin(settings.upper);
    ++evaluations;
    return {inside, f(inside), {}};
  };
  const auto sort = [&] {
    std::stable_sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
  };
  const auto small = [&] {
    double edge = 0;
    for (const Minimum& v : vertices) edge = std::max(edge, (v.x - vertices.front().x).cwiseAbs().maxCoeff());
    const double spread = vertices.back().value - vertices.front().value;
    return edge <= settings.x_tolerance && spread <= settings.f_tolerance * std::fabs(vertices.front().value);
  };
  vertices.push_back(at(start));
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    Eigen::VectorXd x = vertices.front().x;
    x[i] += x[i] + settings.step > settings.upper[i] ? -settings.step : settings.step;
    vertices.push_back(at(x));
  }
  const std::size_t n = vertices.size() - 1;
  for (sort(); evaluations < settings.max_evaluations && !small() && !stop(); sort()) {
    Eigen::VectorXd centre = Eigen::VectorXd::Zero(start.size());
    for (std::size_t i = 0; i < n; ++i) centre += vertices[i].x / static_cast<double>(n);
    const Eigen::VectorXd away = centre - vertices[n].x;
    const Minimum reflected = at(centre + away);
    if (reflected.value < vertices[0].value) {
      const Minimum expanded = at(centre + 2 * away);
      vertices[n] = expanded.value < reflected.value ? expanded : reflected;
    } else if (reflected.value < vertices[n - 1].value) {
      vertices[n] = reflected;
    } else {
      const bool outside = reflected.value < vertices[n].value;
      const Minimum contracted = at(centre + (outside ? 0.5 : -0.5) * away);
      if (contracted.value < std::min(reflected.value, vertices[n].value)) {
        vertices[n] = contracted;
      } else {
        for (std::size_t i = 1; i <= n; ++i) vertices[i] = at((vertices[0].x + vertices[i].x) / 2);
      }
    }
  }
  return vertices.front();
}

Minimum minimise_smooth(const SmoothFunction& f, const Eigen::VectorXd& start, int max_evaluations,
                        const Eigen::MatrixXd& inverse_hessian, const std::function<bool()>& stop) {
  constexpr double kArmijo = 1e-4, kShortest = 1e-8, kMaxStep = 1, kImprovement = 1e-4, kGradient = 1e-3;
  const Eigen::Index n = start.size();
  const bool informed = inverse_hessian.size() > 0;
  int evaluations = 1;
  Eigen::VectorXd gradient(n), next_gradient(n);
  Minimum best{start, f(start, gradient), informed ? inverse_hessian : Eigen::MatrixXd::Identity(n, n)};
  Eigen::MatrixXd& inverse = best.inverse_hessian;
  bool fresh = !informed;  // the Hessian is an initial guess
  while (std::isfinite(best.value) && gradient.cwiseAbs().maxCoeff() > kGradient && !stop()) {
    Eigen::VectorXd step = -inverse * gradient;
    if (!(step.dot(gradient) < 0)) {
      inverse.setIdentity();
      fresh = true;
      step = -gradient;
    }
    if (const double longest = step.cwiseAbs().maxCoeff(); longest > kMaxStep) step *= kMaxStep / longest;
    const double slope = step.dot(gradient);
    double length = 1, value = 0;
    for (;; length = std::clamp(-slope * length * length / (2 * (value - best.value - slope * length)), 0.1 * length,
                                0.5 * length)) {
      if (evaluations >= max_evaluations || length < kShortest) return best;
      value = f(best.x + length * step, next_gradient);
      ++evaluations;
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
    if (won < kImprovement) break;
  }
  return best;
}

}  // namespace prism::training
