// SPDX-License-Identifier: MIT
// Finds the step to which a rate was rounded, if the step is larger than the noise. Then means show no smaller changes.
#pragma once

#include <cstddef>
#include <vector>

namespace prism::recordings {

/// Takes the 1 Hz rate, one value after the other; its memory is constant.
class ResolutionFinder {
 public:
  void push(double rate_deg_per_h);  ///< kUnknown: a gap
  /// The usual difference, deg/h, between successive runs of three or more equal values, if most values are in such
  /// runs. 0: the noise is larger than the step, or the rate stops too rarely to tell.
  double step_deg_per_h() const;

 private:
  void end_run();

  double value_ = 0, last_level_ = 0;
  std::size_t length_ = 0;  ///< of the run that ends with value_
  std::size_t values_ = 0, in_runs_ = 0;
  bool any_level_ = false;
  std::vector<double> steps_;
};

}  // namespace prism::recordings
