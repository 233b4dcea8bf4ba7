// SPDX-License-Identifier: MIT
// Blocks SIGINT, SIGTERM and SIGCHLD except during a wait, so that they interrupt no other call.
#pragma once

#include <signal.h>

namespace prism::campaign {

/// Blocks SIGINT, SIGTERM and SIGCHLD during its lifetime; wait() returns them.
class WatchedSignals {
 public:
  WatchedSignals() {
    ::sigemptyset(&watched_);
    for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) ::sigaddset(&watched_, signal);
    ::pthread_sigmask(SIG_BLOCK, &watched_, &before_);
  }
  ~WatchedSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  WatchedSignals(const WatchedSignals&) = delete;
  WatchedSignals& operator=(const WatchedSignals&) = delete;

  /// Waits for a signal or `timeout_s`. Returns true for SIGINT and SIGTERM.
  bool wait_for_stop(int timeout_s) {
    const timespec timeout{timeout_s, 0};
    const int signal = ::sigtimedwait(&watched_, nullptr, &timeout);
    return signal == SIGINT || signal == SIGTERM;
  }

 private:
  sigset_t watched_{}, before_{};
};

}  // namespace prism::campaign
