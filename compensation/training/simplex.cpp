// SPDX-License-Identifier: MIT
#include "compensation/training/simplex.hpp"

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

}  // namespace prism::training
