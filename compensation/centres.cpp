// SPDX-License-Identifier: MIT
#include "compensation/centres.hpp"

#include <fmt/format.h>

#include "compensation/model_id.hpp"

namespace prism::compensation {
namespace {

constexpr Eigen::Index kMaxCentres = 8000;

}  // namespace

std::string exact_numbers(const Eigen::MatrixXd& matrix) {
  return exact_texts({matrix.data(), static_cast<std::size_t>(matrix.size())});
}

std::string wrong_centres(const ModelInfo& info, const Eigen::MatrixXd& centres, Eigen::Index alphas) {
  const auto d = static_cast<Eigen::Index>(info.inputs.size()), n = centres.cols();
  if (centres.rows() != d || n < 1)
    return fmt::format("found {} inputs for each of {} centres, expected {}", centres.rows(), n, d);
  if (n > kMaxCentres)
    return fmt::format("found {} centres, expected at most {}: more need gigabytes of memory", n, kMaxCentres);
  if (alphas != n) return fmt::format("found {} alphas, expected {}", alphas, n);
  return {};
}

}  // namespace prism::compensation
