// SPDX-License-Identifier: MIT
// The commands of prismcal, one source file each, and their common functions.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/model.hpp"
#include "compensation/training/tuning.hpp"

namespace prism::commands {

// Each function adds a subcommand that sets `code` to its exit code: 0 done, 1 failed or a limit violated.
void add_train_command(CLI::App& app, int& code);     ///< trains a model for prismd on recordings
void add_fit_command(CLI::App& app, int& code);       ///< trains a model on a CSV table
void add_cv_command(CLI::App& app, int& code);        ///< cross-validation errors of an LSSVM on a CSV table
void add_predict_command(CLI::App& app, int& code);   ///< applies a model to the rows of a table
void add_evaluate_command(CLI::App& app, int& code);  ///< evaluates one model on recordings
void add_compare_command(CLI::App& app, int& code);   ///< compares models on recordings
void add_monitor_command(CLI::App& app, int& code);   ///< does a model still hold in a log?
void add_history_command(CLI::App& app, int& code);   ///< which model corrected the rows of a log
void add_inspect_command(CLI::App& app, int& code);   ///< shows how a file of another program is understood
void add_allan_command(CLI::App& app, int& code);     ///< Allan deviation of a recorded rate
void add_convert_command(CLI::App& app, int& code);   ///< converts a recording to a capture
void add_design_command(CLI::App& app, int& code);    ///< plans the next recording
void add_export_command(CLI::App& app, int& code);    ///< writes a model as C for firmware
void add_verify_command(CLI::App& app, int& code);    ///< checks logs and captures
void add_campaign_command(CLI::App& app, int& code);  ///< trains and evaluates models of hundreds of gyros

/// Ends a progress line, prints "prismcal: ERROR" on stderr and returns exit code 1.
int failed(const Error& error);
/// The result, or failed().
int exit_code(const Result<int>& done);

/// Help of the recordings of a command.
inline constexpr const char* kRecordings = "prismd's logs (files or folders), captures, or CSV with --map";

Result<compensation::ModelPtr> load_model(const std::string& path);

/// Reads all *.json of `folder`, sorted by name, for `train --prior`, except models of gyro `own_serial` (if not
/// empty). Errors: a file that is not a model, fewer than two models left.
Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial);

/// After this call, the first Ctrl-C sets the returned flag, and the second one kills the program.
const std::atomic<bool>* stop_on_interrupt();
inline constexpr const char* kStoppedEarly = "stopped early by Ctrl-C, before the best parameters were found";

/// Exit code of `evaluate` if a recording was used in training.
inline constexpr int kNotATest = 3;

/// The progress of a tuning as one line on stderr, if it is a terminal, with the best cost so far.
training::TuningProgress progress_line(bool quiet);

/// Ends that line.
void end_progress();

}  // namespace prism::commands
