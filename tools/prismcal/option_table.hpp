// SPDX-License-Identifier: MIT
// The options of a command as a table. The lines of --help, the completions made from it, and the options in the file
// of a lot (campaign) come from the same rows.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {

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
