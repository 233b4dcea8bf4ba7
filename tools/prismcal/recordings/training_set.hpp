// SPDX-License-Identifier: MIT
// Recordings → training samples: one per block, features by the conditioner that serves live, the earth's rate taken
// off.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "compensation/training/trainer.hpp"
#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/recordings/hold_out.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {

struct TrainingSetOptions {
  SourceOptions source;
  compensation::FeatureDefinition features;
  std::string slope = "difference";
  SiteOptions site;
  std::string hold_out;  ///< see parse_hold_out; empty: every block trains
};

struct TrainingSet {
  training::TrainingData data;  ///< one run per recording
  compensation::FeatureDefinition features;
  std::string axis;                ///< of the device, as the recordings name it; empty: they do not
  std::string serial;              ///< of the gyro, where the recordings name one; empty: unknown
  nlohmann::ordered_json facts;    ///< one object per recording: files with SHA-256, blocks, gaps, earth rate
  std::vector<BlockTable> tables;  ///< one per recording, as the data-quality check takes them
  HoldOut hold_out;
  std::vector<BlockTable> held;    ///< one per recording where blocks are held out, else none
  std::vector<std::string> notes;  ///< gaps and blocks left out, for people
};

/// Refuses recordings of two gyros, inputs that the features do not carry, and what read_recording and split_blocks
/// refuse.
Result<TrainingSet> read_training_set(const std::vector<std::string>& paths, const std::vector<std::string>& inputs,
                                      const TrainingSetOptions& options);

/// The samples of one table, appended as a run of their own; blocks in which an input is unknown are left out and
/// counted.
std::size_t append_blocks(const BlockTable& table, training::TrainingData& data);

}  // namespace prism::recordings
