// SPDX-License-Identifier: MIT
// Confidence interval of the strength of one noise of an Allan curve, whatever the strengths of the others are.
#pragma once

#include "compensation/evaluation/allan_model.hpp"

namespace prism::evaluation {

/// Strengths, 0 or more; low is 0 if the record is compatible with none of this noise.
struct StrengthInterval {
  double low = 0, high = 0;
};

/// The strengths of `noise` (not R) that a test accepts, in `probability` of all records the true one, also if it is 0.
///
/// A strength is tested with the other noises at their best fit for it. The statistic is the signed root of the ratio
/// of the quasi-likelihoods of this strength and of the best one, of a model that is linear near that fit. 1 024 drawn
/// curves give its distribution: it is not normal, because no strength is negative (Self and Liang 1987; the test with
/// fitted other parameters is that of Chuang and Lai 2000). Near 0 the accepted range is one-sided by the rule of
/// Feldman and Cousins (1998), so that an interval from 0 holds the truth as often as any other.
StrengthInterval strength_interval(const AllanModel& model, NoiseType noise, double probability);

}  // namespace prism::evaluation
