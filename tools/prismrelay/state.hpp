// SPDX-License-Identifier: MIT
// State of the relay: written by the loops, read for the status, the metrics and systemd.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tools/prismrelay/batch.hpp"

namespace prism::prismrelay {

double host_time_s();

/// State of PostgreSQL or the broker.
struct TargetState {
  bool up = false;
  double since_s = 0;  ///< host time of the last change of `up`
  std::string error;   ///< of the last failed attempt; empty while up
  std::uint64_t failures = 0, dropped = 0;
  std::uint64_t repeats = 0;  ///< failures with the same error since it was logged
  double committed_s = 0;     ///< host time of the last commit or acknowledged message
};

/// Progress of one axis' log.
struct LogState {
  std::uint64_t rows = 0, invalid = 0, missing = 0;  ///< since the start of the relay
  std::string error;                                 ///< error or invalid response of prismd
  std::string rows_error;                            ///< set by a page without a valid row, cleared by a valid row
  double arrival_s = 0;                              ///< of the last committed row
  double lag_s = 0;                                  ///< from its arrival to its commit
  bool caught_up = false;

  /// The reason why no rows are sent; empty if rows are sent.
  const std::string& fault() const { return error.empty() ? rows_error : error; }
};

struct InstanceState {
  std::string socket;
  std::string state = "gone";  ///< "running", "stopped" (a connection would start it) or "gone"
  std::string error;
  nlohmann::json status;  ///< the last response to `status`; null if not running
};

/// Thread-safe.
class RelayState {
 public:
  /// up() and down() log a change once, with the number of failures in between.
  void up(const std::string& target);
  void down(const std::string& target, const std::string& reason);
  void committed(const std::string& target);
  void dropped(const std::string& target, std::uint64_t count);

  /// Calls `change` with the LogState of `key`, under the lock.
  template <class Change>
  void change_log(const LogKey& key, Change&& change) {
    const std::lock_guard lock(mutex_);
    change(logs_[key]);
  }
  /// Sets the state of an instance; logs a change of its state or error once.
  void instance(const std::string& gyro, const std::string& socket, const std::string& state, const std::string& error);
  void status(const std::string& gyro, nlohmann::json response);
  void forget(const std::string& gyro);
  /// Logs once that an external name is not used.
  void log_skipped(const std::string& name, const std::string& reason);
  /// The same for an axis with an invalid name.
  void log_skipped_axis(const std::string& gyro, const std::string& axis);

  struct View {
    std::map<std::string, TargetState> targets;
    std::map<LogKey, LogState> logs;
    std::map<std::string, InstanceState> instances;
  };
  View view() const;

  /// Each loop calls it regularly, for the watchdog.
  void progress(std::size_t loop) { progress_[loop] = std::chrono::steady_clock::now().time_since_epoch().count(); }
  /// Returns true if each of the first `loops` loops called progress() within `timeout`.
  bool all_progress(std::size_t loops, std::chrono::seconds timeout) const;

 private:
  mutable std::mutex mutex_;
  View view_;
  std::map<LogKey, LogState>& logs_ = view_.logs;
  std::set<std::string> skipped_;
  std::atomic<std::int64_t> progress_[2] = {};
};

/// Writes a printable line to standard error, with the journal's priority if it is connected to the journal.
enum class Level { kError = 3, kWarning = 4, kInfo = 6 };
void log_line(Level level, const std::string& text);

}  // namespace prism::prismrelay
