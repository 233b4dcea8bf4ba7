// SPDX-License-Identifier: MIT
// The commands of prismcal, one source file each, and what all of them do: read and write files, refuse, be
// interrupted.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <string>

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::commands {

// Each adds its subcommand; when that runs, its exit code goes to `code`: 0 done, 1 failed or a limit not kept.
void add_train_command(CLI::App& app, int& code);     ///< a model from recordings, ready for prismd
void add_fit_command(CLI::App& app, int& code);       ///< a model from a plain table; any regression
void add_cv_command(CLI::App& app, int& code);        ///< held-out errors of an LSSVM on a plain table
void add_predict_command(CLI::App& app, int& code);   ///< a model over the rows of a table
void add_evaluate_command(CLI::App& app, int& code);  ///< how good one model is on recordings
void add_compare_command(CLI::App& app, int& code);   ///< several models on several recordings
void add_report_command(CLI::App& app, int& code);    ///< the paper's whole experiment
void add_allan_command(CLI::App& app, int& code);     ///< the Allan deviation of a recorded rate
void add_convert_command(CLI::App& app, int& code);   ///< a recording as a capture
void add_verify_command(CLI::App& app, int& code);    ///< checks prism's files; clean copies
/// All of it for hundreds of gyros, on cores or a cluster; `argv`: the program's arguments, to restart it.
void add_campaign_command(CLI::App& app, int& code, char** argv);

/// "prismcal: …" on stderr, behind the end of a progress line; exit code 1.
int failed(const Error& error);

Result<compensation::ModelPtr> load_model(const std::string& path);

/// From now on Ctrl-C sets this flag; a second one ends the program.
const std::atomic<bool>* stop_on_interrupt();

/// Exit code after Ctrl-C, as shells expect it: 128 + SIGINT.
inline constexpr int kInterrupted = 130;

}  // namespace prism::commands
