// SPDX-License-Identifier: MIT
// A kernel model with fewer centres, for a target with little memory.
#pragma once

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::c_export {

/// Centres of a kernel model; 0 of a polynomial.
int centres_of(const compensation::Model& model);

/// The model with at most `most` (> 0) of its centres, chosen by pivoted Cholesky, and the weights of the function
/// nearest to its own in the kernel's norm. Without a usable standard deviation. Needs a kernel model without a prior.
Result<compensation::ModelPtr> fewer_centres(const compensation::Model& model, int most);

}  // namespace prism::c_export
