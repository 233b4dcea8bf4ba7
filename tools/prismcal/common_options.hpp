// SPDX-License-Identifier: MIT
// Options, recordings and reports of evaluate, compare, monitor and campaign, and an evaluation.
#pragma once

#include <CLI/App.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compensation/evaluation/statistics.hpp"
#include "compensation/model.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/model_evaluation.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::commands {

struct CommonOptions {
  recordings::SourceOptions source;
  recordings::SiteOptions site;
  std::string divisor;                       ///< "N"; else N-1
  std::optional<double> max_bias_deg_per_h;  ///< overrides the configuration
  std::string extrapolation, fallback;       ///< override the configuration; empty: from the configuration
  std::string out;                           ///< folder for report.html, report.json and tables/; empty: none
  std::string pdf, paper = "A4";             ///< file for a PDF, empty: none; "A4" or "letter"
  std::string test;                          ///< file of a TestStatement; empty: none
  bool simulated = false;
  bool any_gyro = false;
  bool all_blocks = false;  ///< every block in the report, also of long recordings
  bool json = false;
  evaluation::Divisor used_divisor() const {
    return divisor == "N" ? evaluation::Divisor::kN : evaluation::Divisor::kNMinus1;
  }
  bool quiet = false;  ///< print neither the path of the report nor how tables were understood
};

void add_common_options(CLI::App& command, CommonOptions& options);

/// --out, --pdf, --paper and --test.
void add_report_options(CLI::App& command, CommonOptions& options);
/// Returns true with --out or --pdf.
bool wants_report(const CommonOptions& options);

/// Statements on a test, from the file of --test; the texts are empty without one.
struct TestStatement {
  std::vector<std::pair<std::string, std::string>> texts;  ///< customer, station, …, sensors
  std::optional<double> warm_up_band_deg_per_h;
};
Result<TestStatement> test_statement(const CommonOptions& options);

/// Fills the first page: `gyro`, then the date of the evaluation, the program and the statements.
void fill_cover(report::Report& report, const std::vector<std::pair<std::string, std::string>>& gyro,
                const TestStatement& test);

/// "cycle1: 2026-11-21 10:15 UTC, 25.67 h".
std::string dates_text(const std::string& name, std::optional<std::int64_t> begin_s, double length_s);

/// Correction settings from --max-bias, --extrapolation and --fallback, else from --config, else the defaults.
Result<analysis::CorrectionSettings> correction_settings(const CommonOptions& options);

using recordings::Loaded;

/// Reads a recording and makes blocks of the model's features. Of one of several recordings, `unmatched` gets the
/// ranges of --leave-out. Errors: also those of check_gyro(), a sensor that is missing; without `unmatched`: a range
/// without a second of it.
Result<Loaded> load_blocks(const std::string& path, const compensation::ModelInfo& model, const CommonOptions& options,
                           recordings::UnmatchedRanges* unmatched = nullptr);

/// Errors: the recording is of another gyro than the model, unless options.any_gyro is set.
Result<void> check_gyro(const std::string& path, const recordings::Recording& recording,
                        const compensation::ModelInfo& model, const CommonOptions& options);

/// Adds a warning to the report that the evaluation on this recording is not a test, and why.
void add_overlap(report::Report& report, const std::string& recording, const std::string& overlap);

/// Adds a recording to the header of a report: files, SHA-256, notes, serial number, site, Earth rate; a warning that
/// it may be the reason of its result (recording_doubts()); marks the report as simulated if the serial number or
/// instance name begins with "sim". Appends its dates_text() to `dates`.
void add_recording(report::Report& report, const Loaded& loaded, const std::vector<std::string>& doubts,
                   std::string& dates);

/// One table of all recordings: length, blocks, gaps, temperature range.
report::Table recordings_table(const std::vector<const Loaded*>& recordings);

/// Writes report.html, report.json and tables/*.csv to options.out, and the PDF to options.pdf, if any,
/// reduced (report::reduced()) without options.all_blocks, and prints the paths on stderr. Prints JSON with
/// options.json.
Result<void> write_report(const report::Report& report, const CommonOptions& options);

// `prismcal evaluate` as a function.

struct EvaluateChoice {
  std::string model, limits;
  std::vector<std::string> recordings;
  bool in_sample = false;  ///< the recordings may be those of the training
  CommonOptions common;
};

struct Evaluation {
  std::vector<analysis::EvaluatedRecording> cases;  ///< in the order of the recordings
  report::Report report;
  bool within_limits = true;  ///< false if a limit of choice.limits is violated
};

/// Errors: those of `prismcal evaluate`. Writes no file; see write_report().
Result<Evaluation> evaluate_recordings(const EvaluateChoice& choice);

}  // namespace prism::commands
