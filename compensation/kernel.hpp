// SPDX-License-Identifier: MIT
// The covariance function of the models (paper eq. 11), and rows, sums and matrices of it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "compensation/model.hpp"

namespace prism::compensation {

/// Maximum error of a single value; the error of a sum is at most this times Σ|alpha_k|. The same bits on every
/// machine.
inline constexpr double kKernelTolerance = 4e-15;

/// A set of centres x_k under one kernel k(x, x') = exp(−‖x − x'‖² / (2 sigma2)).
class KernelCentres {
 public:
  /// `centres` is d × N, one centre per column; sigma2 > 0, in normalised units.
  KernelCentres(const Eigen::MatrixXd& centres, double sigma2);

  /// Σ alpha_k k(point, x_k); alpha: N.
  double sum(const Eigen::VectorXd& point, const Eigen::VectorXd& alpha) const;
  /// k(point, x_k) for the centres from `first` on; `row` has N − first elements.
  void row(const Eigen::Ref<const Eigen::VectorXd>& point, double* row, Eigen::Index first = 0) const;

 private:
  double gamma_;            // 1 / (2 sigma2)
  Eigen::MatrixXd inputs_;  // N × d: one input per column, as the inner loops read them
};

/// K of eq. 9 for points in columns (d × N): symmetric.
Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, double sigma2);

// The composite kernel: a smooth part with one length per input, a linear and a quadratic part.

/// k(x, x') = s1² exp(−Σ (x_i − x'_i)² / (2 l_i²)) + s2² x·x' + s3² (x·x')² on normalised inputs; variances in units of
/// the normalised target.
struct CompositeKernel {
  double rbf = 1;           ///< s1², >= 0
  Eigen::VectorXd length2;  ///< l_i², d of them, > 0
  double linear = 0;        ///< s2², >= 0
  double quadratic = 0;     ///< s3², >= 0

  /// k(x, x).
  double variance(const Eigen::VectorXd& x) const;
  /// Points in columns (d × N): the full matrix K, or its smooth part alone.
  Eigen::MatrixXd matrix(const Eigen::MatrixXd& points) const;
  Eigen::MatrixXd smooth_matrix(const Eigen::MatrixXd& points) const;
};

/// Centres with the kernel's lengths divided out, ready for fast sums and rows.
class CompositeCentres {
 public:
  /// `centres` is d × N, normalised.
  CompositeCentres(CompositeKernel kernel, const Eigen::MatrixXd& centres);

  /// Σ alpha_k k(x, centre_k) with the alpha of the last call of weigh(). Costs one kernel sum and a quadratic form,
  /// because the polynomial parts need no sum: Σ alpha_k (x·c_k)² = xᵀ (Σ alpha_k c_k c_kᵀ) x.
  void weigh(const Eigen::VectorXd& alpha);
  /// Needs weigh().
  double sum(const Eigen::VectorXd& x) const;
  /// k(x, centre_k) for all k.
  Eigen::VectorXd row(const Eigen::VectorXd& x) const;

 private:
  CompositeKernel kernel_;
  Eigen::MatrixXd points_;
  Eigen::VectorXd inverse_length_;
  KernelCentres centres_;      // with the lengths divided out
  Eigen::VectorXd alpha_;      // times s1²
  Eigen::VectorXd linear_;     // s2² Σ alpha_k c_k
  Eigen::MatrixXd quadratic_;  // s3² Σ alpha_k c_k c_kᵀ
};

// Functions of the kernel models for their centres.

/// The numbers in storage order, exact (model.hpp).
std::string exact_numbers(const Eigen::MatrixXd& matrix);

/// Shift and scale between engineering units and the kernel's normalised units: n = (x − shift) / scale.
struct Normalisation {
  Eigen::VectorXd input_shift, input_scale;  ///< d each; scale > 0
  double target_shift = 0, target_scale = 1;

  /// A point of d inputs.
  Eigen::VectorXd of(std::span<const double> inputs) const;
};

/// Returns the error in `centres` [inputs x n] or the normalisation of a model with these inputs and this number of
/// alphas; empty if valid.
std::string wrong_centres(const ModelInfo& info, const Normalisation& normalisation, const Eigen::MatrixXd& centres,
                          Eigen::Index alphas);

// Cholesky factors for published values: the same bits on every x86-64 processor.

/// Lower Cholesky factor in place; the upper triangle is unchanged. Returns false if the matrix is not positive
/// definite. Not the function of libprism-kernels, whose last bits differ between microarchitecture levels.
[[nodiscard]] bool lower_factor(Eigen::MatrixXd& matrix);

/// x ← L⁻¹ x and x ← (L Lᵀ)⁻¹ x for the factor of lower_factor().
void solve_factor(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);
void solve_factored(const Eigen::MatrixXd& factor, Eigen::VectorXd& x);

// Variance of a kernel model's prediction (Gaussian process with an unknown constant), dense or over a few centres.

class PosteriorVariance {
 public:
  /// `covariance`: H of the samples, noise included. Returns nullopt if it is not positive definite. O(N³/3).
  static std::optional<PosteriorVariance> dense(Eigen::MatrixXd covariance);
  /// `kernel`: K over the r centres, K = L Lᵀ. `gram`: (r + 1) × (r + 1), `c` times the precision of [w; constant] with
  /// f = w · φ + constant and φ = L⁻¹ k. Returns nullopt if one of them is not positive definite.
  static std::optional<PosteriorVariance> sparse(Eigen::MatrixXd kernel, Eigen::MatrixXd gram, double c);

  /// `k`: covariances of the point with the samples or centres; `prior`: its own variance.
  /// Dense: prior − kᵀ H⁻¹ k + (1 − nuᵀ k)² / 1ᵀ nu with nu = H⁻¹ 1, the quadratic form of the bordered inverse (eq.
  /// 14). Sparse: prior − φᵀφ + [φ; 1]ᵀ gram⁻¹ [φ; 1] / c: the part that the centres cannot express keeps its prior
  /// variance.
  double at(Eigen::VectorXd k, double prior) const;

 private:
  PosteriorVariance() = default;

  Eigen::MatrixXd factor_, gram_factor_;  // the second is empty if dense
  Eigen::VectorXd nu_;                    // dense
  double ones_ = 0;                       // dense: 1ᵀ nu
  double c_ = 1;                          // sparse
};

}  // namespace prism::compensation
