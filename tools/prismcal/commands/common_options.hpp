// SPDX-License-Identifier: MIT
// Options that evaluate, compare and report share: site of the gyro, divisor, output files.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "compensation/evaluation/statistics.hpp"
#include "compensation/model.hpp"
#include "tools/prismcal/analysis/model_evaluation.hpp"
#include "tools/prismcal/recordings/block_table.hpp"
#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::commands {

struct CommonOptions {
  recordings::SourceOptions source;
  recordings::SiteOptions site;
  evaluation::Divisor divisor = evaluation::Divisor::kNMinus1;
  std::optional<double> max_bias_deg_per_h;  ///< instead of the configuration's
  std::string extrapolation, fallback;       ///< the same; empty: the configuration's
  std::string out;                           ///< folder for report.html, report.csv, report.json; empty: none
  bool simulated = false;
  bool any_gyro = false;
  bool json = false;
  bool quiet = false;  ///< do not say where the report stands
};

void add_common_options(CLI::App& command, CommonOptions& options);

/// How prismd would correct: by --max-bias, --extrapolation and --fallback, else by --config, else by the defaults.
Result<analysis::CorrectionSettings> correction_settings(const CommonOptions& options);

/// Said by --simulated, or by the log: a gyro serial or an instance that begins with "sim".
bool is_simulated(const recordings::Recording& recording, const CommonOptions& options);

/// Reads a recording and puts it on the grid of `features`. With a model: refuses another gyro's, unless any gyro will
/// do.
struct Loaded {
  recordings::Recording recording;
  recordings::BlockTable table;
};
Result<Loaded> load_blocks(const std::string& path, const compensation::FeatureDefinition& features,
                           const compensation::ModelInfo* model, const CommonOptions& options);

/// The header facts of a recording: file, SHA-256, serial, site, earth rate, blocks, gaps.
void append_recording_facts(std::vector<std::pair<std::string, std::string>>& facts, const Loaded& loaded,
                            const std::string& role);

/// Says on top of the report that the judgement on this recording is not a test, and why.
void add_overlap(report::Report& report, const std::string& recording, const std::string& overlap);

/// The recordings in one table: length, blocks, holes, temperature span.
report::Table recordings_table(const std::vector<std::pair<std::string, const Loaded*>>& recordings);

/// Writes report.html, report.csv and report.json into options.out, if any; prints the path on stderr.
Result<void> write_report(const report::Report& report, const CommonOptions& options);

}  // namespace prism::commands
