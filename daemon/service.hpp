// SPDX-License-Identifier: MIT
// The running daemon: data, line, socket, disk and systemd, tied together on one io_context.
#pragma once

#include "daemon/options.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/program.hpp"

namespace prism::daemon {

/// Beside the gyro until SIGTERM or SIGINT. Returns the exit code.
int run_live(const Options& options, pipeline::Setup setup);

/// One capture through the pipeline; prints a summary. Returns the exit code.
int run_replay(const Options& options, pipeline::Setup setup);

}  // namespace prism::daemon
