// SPDX-License-Identifier: MIT
#include "compensation/dense.hpp"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <vector>

#include "compensation/kernel.hpp"

namespace prism::compensation {
namespace {

// Aligned to a cache line: no load of a packed sliver then crosses one.
double* workspace(std::size_t n) {
  constexpr std::size_t kLine = 64;
  thread_local std::vector<double> work;
  const std::size_t wanted = lanes::product_work(n) + kLine / sizeof(double);
  if (work.size() < wanted) work.resize(wanted);
  const auto address = reinterpret_cast<std::uintptr_t>(work.data());
  return work.data() + (kLine - address % kLine) % kLine / sizeof(double);
}

std::size_t size(Eigen::Index n) { return static_cast<std::size_t>(n); }

// C += A B on raw blocks of column-major matrices.
void multiply_add(lanes::Product product) { lane_functions().product(product, workspace(product.n)); }

// W ← L⁻¹ by halves: the inverse of [L11 0; L21 L22] is [W11 0; −W22 L21 W11 W22].
void invert(const double* l, std::size_t ldl, double* w, std::size_t ldw, std::size_t n, std::vector<double>& scratch) {
  constexpr std::size_t kSmall = 32;
  if (n <= kSmall) {
    for (std::size_t j = 0; j < n; ++j) {
      w[j * ldw + j] = 1 / l[j * ldl + j];
      for (std::size_t i = j + 1; i < n; ++i) {
        double dot = 0;
        for (std::size_t k = j; k < i; ++k) dot += l[k * ldl + i] * w[j * ldw + k];
        w[j * ldw + i] = -dot / l[i * ldl + i];
      }
    }
    return;
  }
  const std::size_t a = n / 2, b = n - a;
  invert(l, ldl, w, ldw, a, scratch);
  invert(l + a * ldl + a, ldl, w + a * ldw + a, ldw, b, scratch);
  scratch.assign(a * b, 0.0);
  lanes::Product first{b, a, a, l + a, ldl, w, ldw, scratch.data(), b};
  first.b_transposed = false;
  multiply_add(first);
  lanes::Product second{b, a, b, w + a * ldw + a, ldw, scratch.data(), b, w + a, ldw};
  second.b_transposed = false;
  second.sign = -1;
  multiply_add(second);
}

}  // namespace

void add_gram(const Eigen::MatrixXd& a, Eigen::MatrixXd& c, const Eigen::VectorXd* weights, double sign) {
  add_gram(a, 0, a.cols(), c, weights, sign);
}

void add_gram(const Eigen::MatrixXd& a, Eigen::Index first, Eigen::Index count, Eigen::MatrixXd& c,
              const Eigen::VectorXd* weights, double sign) {
  assert(c.rows() == a.rows() && c.cols() == a.rows());
  const double* begin = a.data() + first * a.rows();
  const std::size_t n = size(a.rows());
  lanes::Product product{n, n, size(count), begin, n, begin, n, c.data(), n};
  product.sign = sign;
  product.weights = weights ? weights->data() + first : nullptr;
  product.lower = true;
  multiply_add(product);
}

bool cholesky(Eigen::MatrixXd& a) {
  const std::size_t n = size(a.rows());
  return lane_functions().cholesky(a.data(), n, n, workspace(n));
}

void solve_lower(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  lane_functions().forward(l.data(), size(l.rows()), size(l.rows()), x.data());
}

void solve_lower_transposed(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  lane_functions().backward(l.data(), size(l.rows()), size(l.rows()), x.data());
}

void solve_cholesky(const Eigen::MatrixXd& l, Eigen::VectorXd& x) {
  solve_lower(l, x);
  solve_lower_transposed(l, x);
}

Eigen::MatrixXd inverse_lower(const Eigen::MatrixXd& l) {
  Eigen::MatrixXd w = Eigen::MatrixXd::Zero(l.rows(), l.cols());
  std::vector<double> scratch;
  invert(l.data(), size(l.rows()), w.data(), size(l.rows()), size(l.rows()), scratch);
  return w;
}

}  // namespace prism::compensation
