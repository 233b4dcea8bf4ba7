// SPDX-License-Identifier: MIT
// A recording as blocks, the samples of the paper: features and bias of each block, and its 1 Hz bias series.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/evaluation/allan.hpp"
#include "compensation/feature_extractor.hpp"
#include "compensation/model.hpp"

namespace prism::recordings {

struct BlockTable {
  std::string name;  ///< name of the recording in reports
  compensation::FeatureDefinition features;
  double earth_rate_deg_per_h = 0;            ///< subtracted from the rate
  std::vector<compensation::Window> blocks;   ///< ready windows, length_s apart; the grid restarts after each gap
  std::vector<compensation::Window> warming;  ///< windows that are not ready, one a second
  std::vector<bool> follows;                  ///< block i starts at the end of block i − 1
  std::vector<double> bias_deg_per_h;         ///< block mean of the rate − Earth rate, one per block
  std::vector<double> second_bias_deg_per_h;  ///< 1 Hz; kUnknown in gaps (at most 60 s of each gap)
  std::vector<std::int64_t> second;           ///< the second of each value of second_bias_deg_per_h
  std::size_t missing_s = 0;                  ///< seconds without a row or without a rate
  std::size_t gaps = 0;                       ///< contiguous runs of such seconds
  std::size_t missing_frames = 0;

  std::size_t size() const { return blocks.size(); }
  std::vector<double> column(
      const std::string& input) const;  ///< values of an input ("T", "dTdt", "U", "lag1", …), one per block
  std::vector<double> hours() const;    ///< end of each block since the start of the first, h
};

/// Runs the one-second means through FeatureExtractor, as prismd does, and keeps the windows that end a block. Skips
/// partial seconds. No window spans two sessions (`sessions`: index of the first second of each; empty: one session). A
/// session that starts before the end of the previous one (the clock was set back) is shifted to follow it.
/// Errors: seconds out of order within a session; no full block, because the recording is too short or full of gaps.
Result<BlockTable> make_block_table(std::span<const compensation::SecondMean> second_means,
                                    const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                    const std::string& name, std::span<const std::size_t> sessions = {});

}  // namespace prism::recordings
