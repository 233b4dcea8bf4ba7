// SPDX-License-Identifier: MIT
// IR-LSSVM (paper section 2.3): train, weigh the residuals, train again; once as the paper, or to a fixed point.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/weights.hpp"

namespace prism::training {

struct ReweightSettings {
  WeightFunction weight;  ///< kNone: plain LSSVM, no re-weighting
  ScaleKind scale = ScaleKind::kMad;
  int limit = 500;  ///< weighted solves at most; 1 is the paper's algorithm
  /// A fixed point is reached when the 2-norm of the change of alpha is at most this (LS-SVMlab's rule, normalised
  /// units), or where double rounding of a system with this c could not show less.
  double tolerance = 1e-4;
  /// Every solve is refined by this matrix over the same samples (not owned), where there is one: needed where the
  /// re-weighting is chaotic (Hampel between two states) and rounding would grow from solve to solve.
  const ExtendedMatrix* extended = nullptr;
};

struct ReweightReport {
  int solves = 0;  ///< weighted solves done
  bool converged = false;
  bool oscillating = false;    ///< the weights alternated between two states; the mean of both was taken
  double scale = 0;            ///< robust scale that gave the last weights
  int dropped = 0;             ///< samples of weight zero
  std::vector<double> change;  ///< 2-norm of the change of alpha, one per solve
};

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
