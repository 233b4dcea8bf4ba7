// SPDX-License-Identifier: MIT
#include "compensation/training/minimise.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace prism::training {
namespace {

struct Vertex {
  Eigen::VectorXd x;
  double value;
};

class Simplex {
 public:
  Simplex(const std::function<double(const Eigen::VectorXd&)>& f, const SimplexSettings& settings)
      : f_(f), settings_(settings) {}

  SimplexResult run(const Eigen::VectorXd& start, const std::function<bool()>& stop) {
    begin(start);
    while (evaluations_ < settings_.max_evaluations && !small() && !stop()) step();
    sort();
    return {vertices_.front().x, vertices_.front().value, evaluations_};
  }

 private:
  Vertex at(const Eigen::VectorXd& x) {
    const Eigen::VectorXd inside = x.cwiseMax(settings_.lower).cwiseMin(settings_.upper);
    ++evaluations_;
    return {inside, f_(inside)};
  }

  void begin(const Eigen::VectorXd& start) {
    vertices_.push_back(at(start));
    for (Eigen::Index i = 0; i < start.size(); ++i) {
      Eigen::VectorXd x = vertices_.front().x;
      x[i] += x[i] + settings_.step[i] > settings_.upper[i] ? -settings_.step[i] : settings_.step[i];
      vertices_.push_back(at(x));
    }
    sort();
  }

  void sort() {
    std::stable_sort(vertices_.begin(), vertices_.end(),
                     [](const Vertex& a, const Vertex& b) { return a.value < b.value; });
  }

  bool small() const {
    double edge = 0;
    for (const Vertex& v : vertices_) edge = std::max(edge, (v.x - vertices_.front().x).cwiseAbs().maxCoeff());
    const double spread = vertices_.back().value - vertices_.front().value;
    return edge <= settings_.x_tolerance && spread <= settings_.f_tolerance * std::fabs(vertices_.front().value);
  }

  void step() {
    const std::size_t n = vertices_.size() - 1;
    Eigen::VectorXd centre = Eigen::VectorXd::Zero(vertices_[0].x.size());
    for (std::size_t i = 0; i < n; ++i) centre += vertices_[i].x / static_cast<double>(n);
    const Eigen::VectorXd away = centre - vertices_[n].x;
    const Vertex reflected = at(centre + away);
    if (reflected.value < vertices_[0].value) {
      const Vertex expanded = at(centre + 2 * away);
      vertices_[n] = expanded.value < reflected.value ? expanded : reflected;
    } else if (reflected.value < vertices_[n - 1].value) {
      vertices_[n] = reflected;
    } else {
      const bool outside = reflected.value < vertices_[n].value;
      const Vertex contracted = at(centre + (outside ? 0.5 : -0.5) * away);
      if (contracted.value < std::min(reflected.value, vertices_[n].value)) {
        vertices_[n] = contracted;
      } else {
        for (std::size_t i = 1; i <= n; ++i) vertices_[i] = at((vertices_[0].x + vertices_[i].x) / 2);
      }
    }
    sort();
  }

  const std::function<double(const Eigen::VectorXd&)>& f_;
  const SimplexSettings& settings_;
  std::vector<Vertex> vertices_;
  int evaluations_ = 0;
};

}  // namespace

SimplexResult minimise(const std::function<double(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& start,
                       const SimplexSettings& settings, const std::function<bool()>& stop) {
  return Simplex(f, settings).run(start, stop);
}

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
