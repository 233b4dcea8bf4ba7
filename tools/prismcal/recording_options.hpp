// SPDX-License-Identifier: MIT
// Options of commands that read recordings. Separate from recordings/, which does not depend on the command line.
#pragma once

#include <CLI/App.hpp>

#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {

/// --decimal, --time-unit; those of 0.3 are refused. Sets options.announce and options.progress to print on stderr.
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

/// All above, and --hold-out.
void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& options);

}  // namespace prism::commands
