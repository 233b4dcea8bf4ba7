// SPDX-License-Identifier: MIT
// The corrections that prismd's engine would apply to one recording with one model, and their quality.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "compensation/compensation_engine.hpp"
#include "compensation/evaluation/bias_stability.hpp"
#include "compensation/evaluation/improvement_interval.hpp"
#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::analysis {

/// The correction settings of a configuration.
struct CorrectionSettings {
  compensation::CompensationSettings engine;  ///< bias limit, and the rule outside the training range
  compensation::ModelPtr fallback;            ///< serves while the window is not full; null: none

  std::string text() const;  ///< one readable line
};

struct ModelEvaluation {
  evaluation::BiasStability stability;  ///< over the blocks that have a correction
  /// The improvement of further recordings; nullopt if these blocks do not determine it.
  std::optional<evaluation::PredictionInterval> next;
  /// 1 − rms(after) / rms(before − mean of the training): what a shift of the bias since then enters, and sigma does
  /// not. Nullopt if the model does not contain that mean.
  std::optional<double> rms_improvement;
  std::vector<double> predicted_deg_per_h;  ///< one per block of the table: its correction; kUnknown if prismd has none
  std::vector<double> corrected_deg_per_h;  ///< one per block: the mean that prismd logs, minus the Earth rate
  /// One per second of the table (table.second): what an Allan deviation after compensation is taken of. Where the
  /// window is full, by the correction of the block that the second lies in; where it is not, by the fallback's of this
  /// second.
  std::vector<double> corrected_second_deg_per_h;
  std::vector<bool> extrapolating;
  std::size_t extrapolated = 0;  ///< how many blocks of them
  std::size_t uncorrected = 0;   ///< blocks whose bias is beyond the limit: prismd publishes no corrected rate there

  std::size_t with_sd = 0;        ///< blocks with a correction whose standard deviation, with noise, the model states
  std::size_t within_two_sd = 0;  ///< those of them that lie within two of it from the prediction
  std::size_t slew_limited = 0;   ///< blocks whose correction the slew limit held back

  /// Share of the blocks outside the training range, %.
  double extrapolated_percent() const {
    return 100 * static_cast<double>(extrapolated) / static_cast<double>(extrapolating.size());
  }
  /// Those of the blocks that have a correction.
  template <class T>
  std::vector<T> where_corrected(const std::vector<T>& blocks) const {
    std::vector<T> kept;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (std::isfinite(corrected_deg_per_h[i])) kept.push_back(blocks[i]);
    }
    return kept;
  }
};

/// "44.1 to 61.3", in percent; "—" without an interval.
std::string interval_text(const std::optional<evaluation::PredictionInterval>& next);

/// Where 95 % of further recordings put the improvement of `other` less that of `first`, in points, over the blocks of
/// `table` that both correct, and whether that is a difference at all: "+1.2 to +4.0: better", "-0.3 to +0.5: not
/// distinguishable". An em dash where these blocks cannot tell.
report::Cell difference_cell(const ModelEvaluation& first, const ModelEvaluation& other,
                             const recordings::BlockTable& table);

/// Runs the engine's correction over every block of `table`, whose features must be the model's own. The slew limit
/// allows from block to block what it allows in the seconds between them, where one follows the other. Refused:
/// features that differ, an input that the recording does not carry, fewer than two blocks with a correction, what
/// Engine::use refuses.
Result<ModelEvaluation> evaluate_model(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                       const CorrectionSettings& settings, evaluation::Divisor divisor);

}  // namespace prism::analysis
