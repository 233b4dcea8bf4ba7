// SPDX-License-Identifier: MIT
// The inner loops that are worth a processor's own instructions: one table of functions per instruction set.
#pragma once

#include <cstddef>

namespace prism::lanes {

/// C += sign · op(A) diag(weights) op(B), everything column-major doubles, C m × n.
struct Product {
  std::size_t m, n, k;
  const double* a;
  std::size_t lda;
  const double* b;
  std::size_t ldb;
  double* c;
  std::size_t ldc;
  double sign = 1;
  const double* weights = nullptr;  ///< k factors, or none
  bool a_transposed = false;        ///< false: A is m × k; true: A is k × m and its transpose is taken
  bool b_transposed = true;         ///< true: B is n × k and its transpose is taken; false: B is k × n
  bool lower = false;               ///< only the lower triangle of C is wanted and touched
};

/// Centres of an RBF kernel, one input a row of `stride` doubles; rows may be read up to kPadding beyond `count`.
struct Centres {
  const double* values;
  std::size_t stride, inputs, count;
};
inline constexpr std::size_t kPadding = 32;

/// exp(−gamma ‖point − centre‖²) for every centre: the sum weighted by alpha (padded with zeros to kPadding), or the
/// row.
struct Table {
  double (*kernel_sum)(const Centres& centres, const double* point, double gamma, const double* alpha);
  void (*kernel_row)(const Centres& centres, const double* point, double gamma, double* row);
  /// `work` holds product_work(n) doubles.
  void (*product)(const Product& product, double* work);
  /// Lower Cholesky factor in place of the n × n matrix; false where a pivot is not positive. The upper part is kept.
  bool (*cholesky)(double* a, std::size_t n, std::size_t lda, double* work);
  /// x ← L⁻¹ x and x ← L⁻ᵀ x.
  void (*forward)(const double* l, std::size_t n, std::size_t ldl, double* x);
  void (*backward)(const double* l, std::size_t n, std::size_t ldl, double* x);
};

inline constexpr std::size_t kDepth = 192;  ///< rows of op(B) packed at a time
inline constexpr std::size_t product_work(std::size_t n) { return (n + 16 + 64) * kDepth; }

extern const Table kBaseline;  ///< whatever the compiler's baseline is: SSE2 on x86-64, NEON on ARM
#if defined(__x86_64__)
extern const Table kAvx2;    ///< with FMA
extern const Table kAvx512;  ///< F, DQ and FMA
#endif

}  // namespace prism::lanes
