// SPDX-License-Identifier: MIT
// The running daemon: connects data, line, socket, disk and systemd on one io_context.
#pragma once

#include "daemon/options.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/program.hpp"

namespace prism::daemon {

/// Runs on the live gyro until SIGTERM or SIGINT. Returns the exit code.
int run_live(const Options& options, pipeline::Setup setup);

/// Processes the captures of options.replay; prints a summary. Returns the exit code.
int run_replay(const Options& options, pipeline::Setup setup);

}  // namespace prism::daemon
