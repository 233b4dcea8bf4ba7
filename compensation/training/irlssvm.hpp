// SPDX-License-Identifier: MIT
// IR-LSSVM (paper section 2.3): train, weigh the residuals, train again; once as the paper, or to a fixed point.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/reweighting.hpp"

namespace prism::training {

struct IrlssvmFit {
  LssvmSolution solution;          ///< alpha is 0 for dropped samples
  Eigen::VectorXd weight;          ///< v_k used in the last solve; 0: dropped
  Eigen::VectorXd residual;        ///< y − f(x_k), dropped samples too
  std::vector<Eigen::Index> kept;  ///< samples with a weight, in order; the factor's rows
  LssvmFactor factor;              ///< of the last system, over `kept`
  ReweightReport report;
};

/// K is the kernel matrix over the samples, y their targets. Zero weights drop samples; at least two must stay.
/// The first solve is unweighted unless `start` gives weights to begin with. Refuses what LssvmFactor refuses.
Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings, const Eigen::VectorXd* start = nullptr);

/// refine() for the last system of a fit, `kernel` over all samples; the residuals follow. Returns the number of steps.
int refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit);

/// The smallest change of alpha that a system with this c can show in double precision.
double rounding_floor(double c, const Eigen::VectorXd& alpha);

}  // namespace prism::training
