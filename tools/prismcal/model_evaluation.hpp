// SPDX-License-Identifier: MIT
// Judges a recording, and a model on it with the corrections that prismd would apply.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compensation/compensation_engine.hpp"
#include "compensation/evaluation/bias_change.hpp"
#include "compensation/evaluation/data_quality.hpp"
#include "compensation/evaluation/drift_fit.hpp"
#include "compensation/evaluation/improvement_interval.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::analysis {

/// The correction settings of a configuration.
struct CorrectionSettings {
  compensation::CompensationSettings engine;  ///< bias limit, and the rule outside the training range
  compensation::ModelPtr fallback;            ///< used while the window is not full; null: none
  double direction_rad = 1e-3;                ///< standard deviation of the axis's direction, each way

  std::string text() const;  ///< one readable line
};

struct ModelEvaluation {
  bool knows_slope = false;             ///< the model has the slope of a temperature as input
  evaluation::BiasStability stability;  ///< over blocks with a correction
  /// 95 % prediction interval of the improvement in another recording; nullopt if these blocks do not determine it.
  std::optional<evaluation::Estimate> improvement_interval;
  /// 1 − rms(after) / rms(before − mean of the training). Unlike 1 sigma it includes a shift of the bias since the
  /// training. Nullopt if the model does not contain the training mean.
  std::optional<double> rms_improvement;
  std::vector<double> predicted_deg_per_h;  ///< correction of each block; kUnknown if prismd has none
  std::vector<double> corrected_deg_per_h;  ///< corrected mean of each block as prismd logs it, minus the Earth rate
  std::vector<double> predicted_warming_deg_per_h;  ///< the same for each window of table.warming: by the fallback
  std::vector<bool> extrapolating;
  std::size_t extrapolated = 0;   ///< number of extrapolating blocks
  std::size_t uncorrected = 0;    ///< blocks for which prismd publishes no corrected rate
  std::size_t without_input = 0;  ///< those of them with an unknown input of the model; the rest: bias above the limit
  std::string missing_input;      ///< of the first of these

  std::size_t with_sd = 0;        ///< blocks with a correction for which the model gives sd_mean (sd with noise)
  std::size_t within_two_sd = 0;  ///< those of them within 2 sd_mean of the prediction
  std::optional<evaluation::BiasChange> change;  ///< since the training; nullopt: the model gives no sd_mean
  std::size_t slew_limited = 0;                  ///< blocks with a correction limited by the slew limit

  /// table.seconds with the correction of the block that contains the second or, if the window is not full, that of the
  /// fallback; for the Allan deviation.
  std::vector<recordings::Series> corrected_seconds_deg_per_h(const recordings::BlockTable& table) const;
  /// Share of the blocks within 2 sd_mean, 0.95 if the sd is right; nullopt: the model gives none.
  std::optional<double> coverage() const {
    if (with_sd == 0) return std::nullopt;
    return static_cast<double>(within_two_sd) / static_cast<double>(with_sd);
  }
  /// Blocks outside the training range, %.
  double extrapolated_percent() const {
    return 100 * static_cast<double>(extrapolated) / static_cast<double>(extrapolating.size());
  }
  /// Returns the elements of `blocks` (one per block) that have a correction.
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
std::string interval_text(const std::optional<evaluation::Estimate>& interval);

/// The improvement of `other` minus that of `first`, in points, over the blocks of `table` that both correct, and its
/// 95 % prediction interval in another recording. Nullopt if these blocks do not determine it.
std::optional<evaluation::Estimate> gain_of(const ModelEvaluation& first, const ModelEvaluation& other,
                                            const recordings::BlockTable& table);

/// Applies the engine's correction to each block of `table`. Between consecutive blocks the slew limit allows the
/// change of all seconds between them. Errors: the features of model and table differ, fewer than two blocks with a
/// correction, and those of CompensationEngine::use().
Result<ModelEvaluation> evaluate_model(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                       const CorrectionSettings& settings, evaluation::Divisor divisor);

// The data quality of a recording, and doubts about it.

Result<evaluation::DataQuality> check_blocks(const recordings::BlockTable& table);

/// {"verdict":…,"nothing_to_compensate":…,"findings":[{"name":…,"verdict":…,"value":…,"unit":…,"warn":…,"refuse":…}…]}
nlohmann::ordered_json data_quality_json(const evaluation::DataQuality& quality);

/// "pass", or "warn (length 150 blocks, expected at least 200)".
std::string data_quality_words(const evaluation::DataQuality& quality);

/// Returns why the recording cannot be used for training; empty if it can.
std::string data_quality_error(const evaluation::DataQuality& quality);

/// A whole recording.
struct Usability {
  Result<evaluation::DataQuality> quality;
  std::string reason;  ///< why it cannot be used; first what was left out of it, which may be the reason. Empty: it can
};
/// `to_train`: else only a disturbance counts, not a record that is short or without a drift.
Usability usability_of(const recordings::Loaded& loaded, bool to_train);

/// Readable reasons to judge the recording before the model that is evaluated on it: disturbed, a drift or mean of the
/// other sign, another mean than in the training, and the `questions` of the recording. Empty: none.
std::vector<std::string> recording_doubts(const recordings::BlockTable& table, const ModelEvaluation& evaluated,
                                          const std::vector<std::string>& questions);

}  // namespace prism::analysis
