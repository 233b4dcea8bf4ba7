// SPDX-License-Identifier: MIT
// What one model does to one recording.
#pragma once

#include <string>
#include <vector>

#include "compensation/evaluation/bias_stability.hpp"
#include "compensation/model.hpp"
#include "tools/prismcal/recordings/block_table.hpp"

namespace prism::analysis {

struct Judgement {
  evaluation::BiasStability stability;
  std::vector<double> predicted_deg_per_h;  ///< one per block of the table
  std::vector<double> corrected_deg_per_h;  ///< bias − predicted
  std::vector<double> sd_deg_per_h;         ///< the model's own; kUnknown where it states none
  std::vector<bool> extrapolating;
  std::size_t extrapolated = 0;  ///< how many of them
};

/// The inputs of `model` from every block of `table`, whose features must be the model's own. Refused: features that
/// differ, an input that the recording does not carry, fewer than two blocks.
Result<Judgement> judge(const compensation::Model& model, const recordings::BlockTable& table,
                        evaluation::Divisor divisor);

/// The 1 Hz bias (table.second) less the prediction of the block that the second lies in; kUnknown outside blocks.
/// What an Allan deviation after compensation is taken of.
std::vector<double> corrected_seconds(const Judgement& judgement, const recordings::BlockTable& table);

}  // namespace prism::analysis
