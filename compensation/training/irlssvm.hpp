// SPDX-License-Identifier: MIT
// IR-LSSVM (paper section 2.3): train, weight by the residuals, train again; once as in the paper, or until
// convergence.
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
  Eigen::VectorXd residual;        ///< y − f(x_k), also for dropped samples
  std::vector<Eigen::Index> kept;  ///< samples with a weight above 0, in order; the factor's rows
  LssvmFactor factor;              ///< of the last system, over `kept`
  ReweightReport report;
};

/// K is the kernel matrix over the samples, y their targets. Zero weights drop samples; at least two must remain. The
/// first solve is unweighted unless `start` contains weights. Errors: those of LssvmFactor.
Result<IrlssvmFit> fit_irlssvm(const Eigen::MatrixXd& kernel, const Eigen::VectorXd& y, double c,
                               const ReweightSettings& settings, const Eigen::VectorXd* start = nullptr);

/// refine() for the last system of a fit, `kernel` over all samples; updates the residuals.
void refine_fit(const ExtendedMatrix& kernel, double c, const Eigen::VectorXd& y, IrlssvmFit& fit);

/// The smallest change of alpha that a system with this c can resolve in double precision.
double rounding_floor(double c, const Eigen::VectorXd& alpha);

}  // namespace prism::training
