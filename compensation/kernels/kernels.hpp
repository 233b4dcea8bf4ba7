// SPDX-License-Identifier: MIT
// The interface of libprism-kernels: the inner loops, compiled once per microarchitecture level of the processor.
//
// The dynamic loader selects the library for the machine (glibc-hwcaps), so the code selects nothing at run time. Only
// pointers and sizes cross the interface, because Eigen's alignment and inline functions differ between levels; the
// version script hides all other symbols. Matrices are column-major without gaps, n rows high.
#pragma once

#include <cstddef>

#pragma GCC visibility push(default)
namespace prism::kernels {

/// Points with one input per row: input i of point k is values[i * stride + k], k < count.
struct Points {
  const double* values;
  std::size_t stride, inputs, count;
};

/// row[k] = exp(−gamma ‖x − point_k‖²), gamma ≥ 0, error below 2 units in the last place; at least exp(−708) = 3e-308.
/// This and rbf_sum() return the same bits at every level, on every processor.
void rbf_row(const Points& points, const double* x, double gamma, double* row);
/// Σ alpha_k exp(−gamma ‖x − point_k‖²).
double rbf_sum(const Points& points, const double* x, double gamma, const double* alpha);

/// c += sign · a diag(weights) aᵀ, lower triangle only; a is n × k, c n × n; weights: k, or null for ones.
void add_gram(const double* a, std::size_t n, std::size_t k, const double* weights, double sign, double* c);
/// Lower Cholesky factor in place of the n × n matrix; the upper triangle is neither read nor written. Returns false if
/// the matrix is not positive definite or not finite; `a` is then overwritten.
[[nodiscard]] bool cholesky(double* a, std::size_t n);
/// x ← L⁻¹ x and x ← L⁻ᵀ x for the factor in the lower triangle of l.
void solve_lower(const double* l, std::size_t n, double* x);
void solve_lower_transposed(const double* l, std::size_t n, double* x);
/// w = L⁻¹, with zeros above its diagonal.
void invert_lower(const double* l, std::size_t n, double* w);

}  // namespace prism::kernels
#pragma GCC visibility pop
