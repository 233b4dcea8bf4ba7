// SPDX-License-Identifier: MIT
// Options of commands that read recordings. Separate from recordings/, which does not depend on the command line.
#pragma once

#include <CLI/App.hpp>

#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/recordings/training_set.hpp"

namespace prism::commands {

/// --map, --interval, --config.
void add_source_options(CLI::App& command, recordings::SourceOptions& options);

/// --latitude, --elevation, --azimuth, --no-earth-rate.
void add_site_options(CLI::App& command, recordings::SiteOptions& options);

/// Those above, and --window, --slope, --end-mean, --max-gap, --lag, --hold-out.
void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& options);

}  // namespace prism::commands
