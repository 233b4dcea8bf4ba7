// SPDX-License-Identifier: MIT
// The RBF kernel in plain loops, which the compiler vectorises for the level. Values are independent, operations are
// not fused (-ffp-contract=off) and the sum has a fixed order. So every level gives the same bits and the same log.
#include <bit>
#include <cstdint>

#include "compensation/kernels/kernels.hpp"

namespace prism::kernels {
namespace {

// exp(x) for x ≤ 0. n = round(x / ln 2) by adding 1.5 · 2^52, after which the low bits are n; r = x − n ln 2 in two
// parts (Cody and Waite 1980), |r| ≤ 0.3466; exp(r) = 1 + 2 r P(r²) / (Q(r²) − r P(r²)) (Moshier's Cephes); times 2^n
// through the exponent.
inline double exp_nonpositive(double x) {
  constexpr double kRound = 0x1.8p52, kLeast = -708;
  x = x < kLeast ? kLeast : x;
  const double t = x * 1.4426950408889634074 + kRound;
  const double n = t - kRound;
  const double r = (x - n * 6.93145751953125e-1) - n * 1.42860682030941723212e-6;
  const double r2 = r * r;
  const double p = r * ((1.26177193074810590878e-4 * r2 + 3.02994407707441961300e-2) * r2 + 1);
  const double q =
      ((3.00198505138664455042e-6 * r2 + 2.52448340349684104192e-3) * r2 + 2.27265548208155028766e-1) * r2 + 2;
  const double half = p / (q - p);
  const std::uint64_t power = (std::bit_cast<std::uint64_t>(t) << 52) + std::bit_cast<std::uint64_t>(1.0);
  return (1 + (half + half)) * std::bit_cast<double>(power);
}

// The values at the points [first, first + count).
inline void rbf(const Points& points, std::size_t first, std::size_t count, const double* x, double gamma,
                double* value) {
  for (std::size_t k = 0; k < count; ++k) value[k] = 0;
  for (std::size_t i = 0; i < points.inputs; ++i) {
    const double* input = points.values + i * points.stride + first;
    for (std::size_t k = 0; k < count; ++k) {
      const double difference = input[k] - x[i];
      value[k] += difference * difference;
    }
  }
  for (std::size_t k = 0; k < count; ++k) value[k] = exp_nonpositive(-gamma * value[k]);
}

}  // namespace

void rbf_row(const Points& points, const double* x, double gamma, double* row) {
  rbf(points, 0, points.count, x, gamma, row);
}

// Point k is added to total k mod 16, for any vector width; then the totals are added in halves.
double rbf_sum(const Points& points, const double* x, double gamma, const double* alpha) {
  constexpr std::size_t kTotals = 16, kChunk = 256;  // a chunk of values stays in the L1 cache
  double total[kTotals] = {}, value[kChunk];
  for (std::size_t first = 0; first < points.count; first += kChunk, alpha += kChunk) {
    const std::size_t count = points.count - first < kChunk ? points.count - first : kChunk;
    rbf(points, first, count, x, gamma, value);
    std::size_t k = 0;
    for (; k + kTotals <= count; k += kTotals) {
      for (std::size_t j = 0; j < kTotals; ++j) total[j] += alpha[k + j] * value[k + j];
    }
    for (std::size_t j = 0; k + j < count; ++j) total[j] += alpha[k + j] * value[k + j];
  }
  for (std::size_t half = kTotals / 2; half > 0; half /= 2) {
    for (std::size_t j = 0; j < half; ++j) total[j] += total[j + half];
  }
  return total[0];
}

}  // namespace prism::kernels
