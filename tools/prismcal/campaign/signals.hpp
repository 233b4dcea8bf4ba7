// SPDX-License-Identifier: MIT
// Ctrl-C, SIGTERM and the end of a child, waited for in one place instead of interrupting any.
#pragma once

#include <signal.h>

namespace prism::campaign {

/// While it lives, SIGINT, SIGTERM and SIGCHLD are held back and handed out by wait().
class WatchedSignals {
 public:
  WatchedSignals() {
    sigset_t watched = set();
    ::pthread_sigmask(SIG_BLOCK, &watched, &before_);
  }
  ~WatchedSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  WatchedSignals(const WatchedSignals&) = delete;
  WatchedSignals& operator=(const WatchedSignals&) = delete;

  /// The next signal, or 0 after so many milliseconds without one.
  int wait(int timeout_ms) {
    const sigset_t watched = set();
    const timespec timeout{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000L};
    const int signal = ::sigtimedwait(&watched, nullptr, &timeout);
    return signal > 0 ? signal : 0;
  }

  /// In a child between fork and exec, which inherits what is held back.
  static void release() {
    sigset_t watched = set();
    ::pthread_sigmask(SIG_UNBLOCK, &watched, nullptr);
  }

 private:
  static sigset_t set() {
    sigset_t signals;
    ::sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) ::sigaddset(&signals, signal);
    return signals;
  }
  sigset_t before_{};
};

}  // namespace prism::campaign
