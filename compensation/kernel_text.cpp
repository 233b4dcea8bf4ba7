// SPDX-License-Identifier: MIT
#include "compensation/kernel_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/centres.hpp"
#include "compensation/model_id.hpp"

namespace prism::compensation {

Eigen::VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Normalisation read_normalisation(Section section) {
  Normalisation n;
  n.input_shift = vector_of(section.numbers("input_shift", kAnyNumber));
  n.input_scale = vector_of(section.numbers("input_scale", kPositive));
  n.target_shift = section.number("target_shift", kAnyNumber);
  n.target_scale = section.number("target_scale", kPositive);
  return n;
}

Eigen::MatrixXd symmetric_of(Section& section, const char* key, const std::vector<double>& lower) {
  const auto n = static_cast<Eigen::Index>((std::sqrt(8.0 * static_cast<double>(lower.size()) + 1) - 1) / 2 + 0.5);
  if (static_cast<std::size_t>(n * (n + 1) / 2) != lower.size()) {
    section.fail(key, fmt::format("found {} numbers, expected n (n + 1) / 2", lower.size()));
    return {};
  }
  Eigen::MatrixXd m(n, n);
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) m(i, j) = m(j, i) = lower[at++];
  }
  return m;
}

Eigen::MatrixXd centres_of(Section& section, const std::vector<double>& numbers, std::size_t inputs,
                           Eigen::Index alphas) {
  const auto d = static_cast<Eigen::Index>(inputs);
  if (section.good() && static_cast<Eigen::Index>(numbers.size()) != d * alphas) {
    section.fail("centres", fmt::format("found {} numbers, expected {}: {} inputs for each of {} alphas",
                                        numbers.size(), d * alphas, d, alphas));
  }
  if (!section.good()) return {};
  return Eigen::Map<const Eigen::MatrixXd>(numbers.data(), d, alphas);
}

std::string normalisation_text(const Normalisation& n) {
  return fmt::format(
      "  \"normalisation\": {{\"input_shift\": {}, \"input_scale\": {}, \"target_shift\": {}, \"target_scale\": "
      "{}}},\n",
      exact_numbers(n.input_shift), exact_numbers(n.input_scale), exact_text(n.target_shift),
      exact_text(n.target_scale));
}

void append_rows(std::string& text, const char* key, const Eigen::MatrixXd& values, Eigen::Index width) {
  text += fmt::format("  \"{}\": [", key);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (i % width == 0) text += i > 0 ? ",\n    " : "\n    ";
    text += fmt::format("{}{}", i % width ? ", " : "", exact_text(values.data()[i]));
  }
  text += "\n  ],\n";
}

std::string triangle_text(const Eigen::MatrixXd& m) {
  std::string text;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    text += i == 0 ? "    " : ",\n    ";
    for (Eigen::Index j = 0; j <= i; ++j) text += (j ? ", " : "") + exact_text(m(i, j));
  }
  return text;
}

}  // namespace prism::compensation
