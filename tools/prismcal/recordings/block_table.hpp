// SPDX-License-Identifier: MIT
// A recording on the paper's sample grid: one row of features and bias for each block, and the seconds behind them.
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
  std::string name;  ///< of the recording, for people
  compensation::FeatureDefinition features;
  double earth_rate_deg_per_h = 0;            ///< what was taken off the rate
  std::vector<compensation::Window> blocks;   ///< ready windows, length_s apart; the grid begins anew after every gap
  std::vector<compensation::Window> warming;  ///< windows that are not ready, one a second
  std::vector<bool> follows;                  ///< block i begins where block i − 1 ended
  std::vector<double> bias_deg_per_h;         ///< block mean of the rate − earth rate, one per block
  std::vector<double> second_bias_deg_per_h;  ///< 1 Hz; kUnknown: a hole (a long one is cut to a minute)
  std::vector<std::int64_t> second;           ///< which second each of them is
  std::size_t missing_s = 0;                  ///< seconds without a row or without a rate
  std::size_t gaps = 0;                       ///< stretches of such seconds
  std::size_t missing_frames = 0;

  std::size_t size() const { return blocks.size(); }
  std::vector<double> column(const std::string& input) const;  ///< of the blocks: "T", "dTdt", "U", "lag1", …
  std::vector<double> hours() const;                           ///< end of each block since the first second, h
};

/// Runs the one-second means through the conditioner of live and training and keeps the windows that end a block.
/// Seconds that a session cut are in none, and no window spans two sessions (`sessions`: where they begin; empty: one).
/// Where a session begins before the one before it ended, as the clock was set back, it is laid behind that. Refused:
/// no one-second means, seconds out of order within a session, no full block (a recording shorter than the window, or
/// ridden with gaps).
Result<BlockTable> make_block_table(std::span<const compensation::SecondMean> second_means,
                                    const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                    const std::string& name, std::span<const std::size_t> sessions = {});

}  // namespace prism::recordings
