// SPDX-License-Identifier: MIT
#include "tools/prismcal/c_export/fewer_centres.hpp"

#include "compensation/composite_model.hpp"
#include "compensation/lssvm_model.hpp"
#include "compensation/training/low_rank.hpp"

namespace prism::c_export {
namespace {

using compensation::CompositeModel;
using compensation::LssvmModel;

constexpr double kNoMore = 1e-12;  // of the largest variance: a further centre would only add rounding

// K ≈ Gᵀ G, G = [R ·] with R over the pivots p: the projection's weights w solve K_pp w = K_p alpha, R w = G alpha.
void project(const Eigen::MatrixXd& kernel, int most, Eigen::MatrixXd& centres, Eigen::VectorXd& alpha) {
  const Eigen::VectorXd variance = kernel.diagonal();
  const auto found = training::pivoted_cholesky(
      variance, [&kernel](Eigen::Index i, Eigen::VectorXd& row) { row = kernel.col(i); }, kNoMore * variance.maxCoeff(),
      most);
  const auto g = found.features.topRows(found.rank());
  const Eigen::MatrixXd r = g(Eigen::all, found.pivots);
  const Eigen::VectorXd right = g * alpha;
  alpha = r.triangularView<Eigen::Upper>().solve(right);
  centres = Eigen::MatrixXd(centres(Eigen::all, found.pivots));
}

}  // namespace

int centres_of(const compensation::Model& model) {
  if (const auto* composite = dynamic_cast<const CompositeModel*>(&model))
    return static_cast<int>(composite->parameters().centres.cols());
  const auto* kernel = dynamic_cast<const LssvmModel*>(&model);
  return kernel ? static_cast<int>(kernel->parameters().centres.cols()) : 0;
}

Result<compensation::ModelPtr> fewer_centres(const compensation::Model& model, int most) {
  if (const auto* composite = dynamic_cast<const CompositeModel*>(&model)) {
    auto p = composite->parameters();
    project(p.variances.kernel.matrix(p.centres), most, p.centres, p.alpha);
    p.gram = Eigen::MatrixXd::Identity(p.centres.cols() + 1, p.centres.cols() + 1);
    return CompositeModel::make(model.info(), std::move(p));
  }
  auto p = dynamic_cast<const LssvmModel&>(model).parameters();
  project(compensation::kernel_matrix(p.centres, {p.sigma2}), most, p.centres, p.alpha);
  p.weight.resize(0);
  p.uncertainty.reset();
  return LssvmModel::make(model.info(), std::move(p));
}

}  // namespace prism::c_export
