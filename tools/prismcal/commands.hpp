// SPDX-License-Identifier: MIT
// The commands of prismcal, one source file each, their options, and their common functions.
#pragma once

#include <CLI/App.hpp>
#include <atomic>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/result.hpp"
#include "compensation/model.hpp"
#include "compensation/training/tuning.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/training_set.hpp"

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

/// Adds a subcommand that runs `run` with its choice. Returns both, to add the options; the subcommand owns the choice.
template <class Choice>
std::pair<CLI::App&, Choice&> new_command(CLI::App& app, int& code, const char* name, const char* help,
                                          Result<int> (*run)(const Choice&)) {
  CLI::App* command = app.add_subcommand(name, help);
  const auto choice = std::make_shared<Choice>();
  command->callback([choice, run, &code] { code = exit_code(run(*choice)); });
  return {*command, *choice};
}

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

/// Checks log segments (formats 1 and 2) and captures, or all of them in folders and below, with the readers of the
/// other tools. Never fails: an unreadable file is a finding. Returns what --json prints: "faults", a number;
/// "findings" of files, or of a folder's log: path, state (prismcal(1), VERIFYING), text, line (from 1; none: the whole
/// file), fault; "sessions" of logs: log, axis (null: the only one), ends of the first and last second (first_s,
/// last_s; since 1970 or the device's epoch), rows, partial, missing_s, missing_frames, and holes: ends of the first
/// and last of consecutive seconds without a row. These are not faults: they come from the line or the machine.
nlohmann::ordered_json verify(const std::vector<std::string>& paths);

// The options of a command as a table. The lines of --help, the completions made from it, and the options in the file
// of a lot (campaign) come from the same rows.

enum class Need {
  kUsual,
  kRequired,
  kFew,  ///< few users need it: in the second section of --help
};

/// `flag`: "--out", or "recordings" for an argument. `member` is where the value is stored; its value is the default,
/// shown if it is a text or a number other than 0. A bool is a flag.
struct OptionRow {
  const char* flag;
  std::variant<bool*, std::string*, double*, int*, std::uint64_t*, std::optional<double>*, std::vector<std::string>*>
      member;
  std::string help;
  std::optional<CLI::Validator> check{};  ///< its range (tools/command_line.hpp) or its names (one_of())
};

/// Refuses an option of an earlier version, which has no help.
void refuse_removed(CLI::App& command, const char* name, const char* instead);

CLI::Validator one_of(std::vector<std::string> names);

/// Adds all rows; returns their options in this order.
std::vector<CLI::Option*> add_options(CLI::App& command, const std::vector<OptionRow>& rows, Need need = Need::kUsual);

// Options that several commands share.

/// --decimal, --time-unit; those of 0.3 are refused. Sets options.announce to print on stderr.
void add_table_options(CLI::App& command, tables::TableOptions& options);

/// --map, --interval, --config, --axis, --leave-out, and those of add_table_options().
void add_source_options(CLI::App& command, recordings::SourceOptions& options);

/// --latitude, --elevation, --azimuth, --no-earth-rate.
void add_site_options(CLI::App& command, recordings::SiteOptions& options);

/// The same without effect and without help, for commands that do not need the Earth rate: the options of a file are
/// the same for all commands.
void accept_site_options(CLI::App& command);

/// --window, --slope, --end-mean, --max-gap.
void add_window_options(CLI::App& command, recordings::TrainingSetOptions& options);

/// All above.
void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& options);

}  // namespace prism::commands
