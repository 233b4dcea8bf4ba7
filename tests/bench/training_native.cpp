// SPDX-License-Identifier: MIT
// References of bench_training, built for this machine: Eigen's factor, and a bare vectorised exponential sum. Eigen is
// renamed here, so that other files do not link functions built for this machine.
#define Eigen EigenNative
#include <Eigen/Cholesky>
#include <Eigen/Core>
#undef Eigen

// Σ alpha_k exp(−d2_k / 2 sigma2) over centres stored with one input per row.
double native_kernel_sum(const double* centres, long count, const double* point, double gamma, const double* alpha) {
  using Row = EigenNative::Map<const EigenNative::ArrayXd>;
  thread_local EigenNative::ArrayXd d2;
  d2 = (Row(centres, count) - point[0]).square() + (Row(centres + count, count) - point[1]).square() +
       (Row(centres + 2 * count, count) - point[2]).square();
  return (Row(alpha, count) * (d2 * -gamma).exp()).sum();
}

// Eigen's LLT of a copy of the matrix; returns a number so that nothing is optimised away.
double native_llt(const double* matrix, long n) {
  const EigenNative::LLT<EigenNative::MatrixXd> llt(EigenNative::Map<const EigenNative::MatrixXd>(matrix, n, n));
  return llt.matrixLLT()(n - 1, n - 1);
}
