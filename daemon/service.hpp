// SPDX-License-Identifier: MIT
// The running daemon: data, line, socket, disk and systemd, tied together on one io_context.
#pragma once

#include "daemon/event_log.hpp"
#include "daemon/options.hpp"
#include "daemon/pipeline/setup.hpp"

namespace prism::daemon {

inline constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 64, kExitBug = 70, kExitConfig = 78;

/// An event as a line on stderr.
void log_event(const Event& event);

/// Waits half a second at most until every message is written.
void finish_logging();

/// Beside the gyro until SIGTERM or SIGINT. Returns the exit code.
int run_live(const Options& options, pipeline::Setup setup);

/// One capture through the pipeline; prints a summary. Returns the exit code.
int run_replay(const Options& options, pipeline::Setup setup);

}  // namespace prism::daemon
