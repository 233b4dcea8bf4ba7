// SPDX-License-Identifier: MIT
// The RBF kernel (paper eq. 11) over a set of centres, with the processor's own instructions chosen at run time.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "compensation/lanes/table.hpp"
#include "compensation/result.hpp"

namespace prism::compensation {

/// The ways to the same sum. kScalar is the reference: one std::exp a centre, in order. The others differ from it by at
/// most kKernelTolerance · Σ|alpha_k| in a sum, and by kKernelTolerance in a single value.
enum class KernelPath { kScalar, kBaseline, kAvx2, kAvx512 };
inline constexpr double kKernelTolerance = 4e-15;

/// "scalar", "baseline", "avx2", "avx512".
const char* kernel_path_name(KernelPath path);
Result<KernelPath> parse_kernel_path(std::string_view name);
bool kernel_path_available(KernelPath path);

/// The path in force for the whole process: the best available one unless use_kernel_path() said otherwise. Results are
/// reproducible bit by bit on one path; a log that must not depend on the machine forces kScalar or kBaseline.
KernelPath kernel_path();
/// Refuses a path that this machine does not have. Not to be called while others compute.
Result<void> use_kernel_path(KernelPath path);
/// The functions of the path in force.
const lanes::Table& lane_functions();

/// Centres laid out for the inner loops: one input a row, padded.
class KernelCentres {
 public:
  KernelCentres() = default;
  /// `centres` is d × N, one centre a column.
  explicit KernelCentres(const Eigen::MatrixXd& centres);

  std::size_t count() const { return count_; }
  std::size_t inputs() const { return inputs_; }
  /// alpha with the zeros behind it that sum() wants.
  std::vector<double> padded(const Eigen::VectorXd& alpha) const;

  /// Σ alpha_k exp(−‖point − centre_k‖² / (2 sigma2)); alpha as padded() gives it.
  double sum(std::span<const double> point, double sigma2, std::span<const double> alpha) const;
  /// exp(−‖point − centre_k‖² / (2 sigma2)) for the centres from `first` on; `row` has count() − first places.
  void row(std::span<const double> point, double sigma2, double* row, std::size_t first = 0) const;

 private:
  std::size_t inputs_ = 0, count_ = 0, stride_ = 0;
  std::vector<double> values_;
};

/// K of eq. 9 for points in columns (d × N): symmetric, ones on its diagonal.
Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, double sigma2);

}  // namespace prism::compensation
