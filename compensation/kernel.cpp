// SPDX-License-Identifier: MIT
#include "compensation/kernel.hpp"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <cmath>

namespace prism::compensation {
namespace {

constexpr std::array kPathNames = {"scalar", "baseline", "avx2", "avx512"};

double distance2(const lanes::Centres& centres, const double* point, std::size_t k) {
  double total = 0;
  for (std::size_t i = 0; i < centres.inputs; ++i) {
    const double difference = centres.values[i * centres.stride + k] - point[i];
    total += difference * difference;
  }
  return total;
}

double scalar_sum(const lanes::Centres& centres, const double* point, double gamma, const double* alpha) {
  double total = 0;
  for (std::size_t k = 0; k < centres.count; ++k) total += alpha[k] * std::exp(-gamma * distance2(centres, point, k));
  return total;
}

void scalar_row(const lanes::Centres& centres, const double* point, double gamma, double* row) {
  for (std::size_t k = 0; k < centres.count; ++k) row[k] = std::exp(-gamma * distance2(centres, point, k));
}

// The reference for the kernel; products and factors take the baseline, which every machine has.
lanes::Table scalar_table() {
  lanes::Table table = lanes::kBaseline;
  table.kernel_sum = scalar_sum;
  table.kernel_row = scalar_row;
  return table;
}

KernelPath best_path() {
  for (const KernelPath path : {KernelPath::kAvx512, KernelPath::kAvx2}) {
    if (kernel_path_available(path)) return path;
  }
  return KernelPath::kBaseline;
}

const lanes::Table* table_of(KernelPath path) {
  static const lanes::Table kScalarTable = scalar_table();
  switch (path) {
    case KernelPath::kScalar:
      return &kScalarTable;
#if defined(__x86_64__)
    case KernelPath::kAvx2:
      return &lanes::kAvx2;
    case KernelPath::kAvx512:
      return &lanes::kAvx512;
#endif
    default:
      return &lanes::kBaseline;
  }
}

struct Choice {
  KernelPath path = best_path();
  const lanes::Table* table = table_of(path);
};

Choice& choice() {
  static Choice chosen;
  return chosen;
}

}  // namespace

const char* kernel_path_name(KernelPath path) { return kPathNames[static_cast<std::size_t>(path)]; }

Result<KernelPath> parse_kernel_path(std::string_view name) {
  for (std::size_t i = 0; i < kPathNames.size(); ++i) {
    if (name == kPathNames[i]) return static_cast<KernelPath>(i);
  }
  return refuse("kernel path", fmt::format("found \"{}\", expected scalar, baseline, avx2 or avx512", name));
}

bool kernel_path_available(KernelPath path) {
#if defined(__x86_64__)
  if (path == KernelPath::kAvx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (path == KernelPath::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("fma");
  }
#endif
  return path == KernelPath::kScalar || path == KernelPath::kBaseline;
}

KernelPath kernel_path() { return choice().path; }

Result<void> use_kernel_path(KernelPath path) {
  if (!kernel_path_available(path)) {
    return refuse("kernel path", fmt::format("found {}, expected one that this processor has", kernel_path_name(path)));
  }
  choice() = {path, table_of(path)};
  return {};
}

const lanes::Table& lane_functions() { return *choice().table; }

KernelCentres::KernelCentres(const Eigen::MatrixXd& centres)
    : inputs_(static_cast<std::size_t>(centres.rows())), count_(static_cast<std::size_t>(centres.cols())) {
  stride_ = count_ + lanes::kPadding;
  values_.assign(inputs_ * stride_, 0.0);
  for (std::size_t i = 0; i < inputs_; ++i) {
    for (std::size_t k = 0; k < count_; ++k) {
      values_[i * stride_ + k] = centres(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    }
  }
}

std::vector<double> KernelCentres::padded(const Eigen::VectorXd& alpha) const {
  assert(static_cast<std::size_t>(alpha.size()) == count_);
  std::vector<double> values(alpha.data(), alpha.data() + alpha.size());
  values.resize(count_ + lanes::kPadding, 0.0);
  return values;
}

double KernelCentres::sum(std::span<const double> point, double sigma2, std::span<const double> alpha) const {
  assert(point.size() == inputs_ && alpha.size() >= count_ + lanes::kPadding);
  const lanes::Centres centres{values_.data(), stride_, inputs_, count_};
  return lane_functions().kernel_sum(centres, point.data(), 0.5 / sigma2, alpha.data());
}

void KernelCentres::row(std::span<const double> point, double sigma2, double* row, std::size_t first) const {
  assert(point.size() == inputs_ && first <= count_);
  const lanes::Centres centres{values_.data() + first, stride_, inputs_, count_ - first};
  lane_functions().kernel_row(centres, point.data(), 0.5 / sigma2, row);
}

Eigen::MatrixXd kernel_matrix(const Eigen::MatrixXd& points, double sigma2) {
  const Eigen::Index n = points.cols(), d = points.rows();
  const KernelCentres centres(points);
  Eigen::MatrixXd k(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::span<const double> point(points.data() + j * d, static_cast<std::size_t>(d));
    centres.row(point, sigma2, k.data() + j * n + j, static_cast<std::size_t>(j));
  }
  constexpr Eigen::Index kBlock = 32;  // mirrored in blocks, so that neither side of the copy leaves the cache
  for (Eigen::Index j = 0; j < n; j += kBlock) {
    for (Eigen::Index i = j; i < n; i += kBlock) {
      const Eigen::Index columns = std::min(kBlock, n - j), rows = std::min(kBlock, n - i);
      for (Eigen::Index a = 0; a < rows; ++a) {
        for (Eigen::Index b = 0; b < columns && j + b < i + a; ++b) k(j + b, i + a) = k(i + a, j + b);
      }
    }
  }
  return k;
}

}  // namespace prism::compensation
