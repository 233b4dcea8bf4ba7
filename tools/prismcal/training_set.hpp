// SPDX-License-Identifier: MIT
// Recordings → training samples, one per block, and the choice of their inputs. Uses the same feature extraction as
// prismd and subtracts the Earth rate.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "compensation/evaluation/data_quality.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {

struct TrainingSetOptions {
  SourceOptions source;
  compensation::FeatureDefinition features;
  std::string slope = "difference";
  SiteOptions site;
  bool strict = false;  ///< the first of several recordings that cannot be used is an error

  /// The features with `slope`.
  compensation::FeatureDefinition window() const;
};

/// Recordings that cannot be used: path, and reason.
using Unusable = std::vector<std::pair<std::string, std::string>>;

/// Calls `use` with each path, and returns those with an error. Errors: that of the only one, or with `strict` the
/// first; if none is left, how many there are and the first.
Result<Unusable> use_each(const std::vector<std::string>& paths, bool strict,
                          const std::function<Result<void>(const std::string& path)>& use);

struct TrainingSet {
  training::TrainingData data;  ///< one run per recording
  compensation::FeatureDefinition features;
  std::string axis;                ///< axis name in the recordings; empty: none
  std::string serial;              ///< gyro serial number in the recordings; empty: unknown
  nlohmann::ordered_json facts;    ///< one object per recording: files with SHA-256, blocks, gaps, Earth rate, remarks
  std::vector<Loaded> recordings;  ///< without the `seconds` of their tables
  std::vector<evaluation::DataQuality> qualities;  ///< of each recording, by `judge`
  double second_sd_deg_per_h = kUnknown;           ///< of one-second means within a window's length: the median
  Unusable left_out;
  std::vector<std::string> notes;      ///< readable lines on gaps and blocks left out, and the questions
  std::vector<std::string> questions;  ///< Recording::questions of all
};

/// The data quality of a recording, or why it cannot be used.
using Judge = std::function<Result<evaluation::DataQuality>(const Loaded&)>;

/// Leaves out recordings that `judge` refuses, and those with an error, as use_each() does: another gyro or axis than
/// before, inputs that it does not have, and those of read_recording(). Errors: also no block with
/// all inputs.
Result<TrainingSet> read_training_set(const std::vector<std::string>& paths, const std::vector<std::string>& inputs,
                                      const TrainingSetOptions& options, const Judge& judge = {});

/// An entry of the provenance: name, files with SHA-256, blocks, gaps, Earth rate, remarks, fingerprint.
nlohmann::ordered_json facts_of(const Recording& recording, const BlockTable& table, std::size_t left_out);

/// Appends the samples of one table as a new run. Leaves out blocks with an unknown bias or input, and returns
/// their number.
std::size_t append_blocks(const BlockTable& table, training::TrainingData& data);

// `--inputs auto`: the smallest set of inputs that predicts held-out parts of the recordings well.

/// A set of inputs, evaluated by polynomials of second order on contiguous held-out parts of the record.
struct InputSet {
  std::vector<std::string> inputs;
  double error_deg_per_h = 0;           ///< rms over the held-out parts
  double standard_error_deg_per_h = 0;  ///< of that rms, between parts
};

struct InputSearch {
  double without_deg_per_h = 0;  ///< the held-out rms of a constant (the mean)
  std::vector<InputSet> alone;   ///< each candidate alone, in their order
  std::vector<InputSet> path;    ///< each set adds the most helpful candidate to the one before
  std::size_t chosen = 0;        ///< index in path: the smallest set within one standard error of the best

  const InputSet& best() const { return path[chosen]; }
};

/// The possible inputs of a recording: T, dTdt, U, and for each sensor its difference to T (if in degC, else
/// its value) and its slope. Omits quantities known in 90 % of the blocks or less, and sensors that equal T.
Result<std::vector<std::string>> candidate_inputs(const std::string& path, const TrainingSetOptions& options);

/// Forward selection among the data's inputs, at most six of them. Ignores constant candidates. Errors: all are
/// constant, or fewer than 40 samples.
Result<InputSearch> search_inputs(const training::TrainingData& data);

/// The result as a readable table and as JSON.
std::string search_text(const InputSearch& search);
nlohmann::ordered_json search_json(const InputSearch& search);

}  // namespace prism::recordings
