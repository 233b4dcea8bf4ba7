// SPDX-License-Identifier: MIT
#include "compensation/block_stability.hpp"

#include <cmath>

namespace prism::compensation {

void RunningVariance::add(double value) {
  ++count_;
  const double delta = value - mean_;
  mean_ += delta / static_cast<double>(count_);
  squares_ += delta * (value - mean_);
}

double RunningVariance::sd() const {
  return count_ > 1 ? std::sqrt(squares_ / static_cast<double>(count_ - 1)) : kUnknown;
}

void BlockStability::add(const CompensatedWindow& row, int length_s) {
  if (row.window.state != WindowState::kReady) {
    next_end_.reset();  // the grid restarts after a gap: a block never spans one
    return;
  }
  const std::int64_t second = row.window.second_mean.second;
  if (next_end_ && second < *next_end_) return;
  next_end_ = second + length_s;
  if (!std::isfinite(row.window.rate_deg_per_h)) return;
  all_.add(row.window.rate_deg_per_h);
  if (!std::isfinite(row.corrected_mean_deg_per_h)) return;
  raw_.add(row.window.rate_deg_per_h);
  corrected_.add(row.corrected_mean_deg_per_h);
}

std::optional<double> BlockStability::improvement() const {
  if (!(raw_.sd() > 0)) return std::nullopt;
  return 1 - corrected_.sd() / raw_.sd();
}

}  // namespace prism::compensation
