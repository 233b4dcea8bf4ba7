// SPDX-License-Identifier: MIT
// What the relay says of itself: written by the loops, read for the status, the metrics and systemd.
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

/// PostgreSQL or the broker.
struct TargetState {
  bool up = false;
  double since_s = 0;  ///< host time of the last change of `up`
  std::string error;   ///< of the last attempt that failed; empty while it is up
  std::uint64_t failures = 0, dropped = 0;
  double committed_s = 0;  ///< host time of the last row or message that was acknowledged
};

/// One axis' log on its way into the ledger.
struct LogState {
  std::uint64_t rows = 0, refused = 0, missing = 0;  ///< since the relay runs
  std::string error;                                 ///< what prismd answered instead of rows
  std::string rows_error;                            ///< why no line of the last page was a row; until one is
  double arrival_s = 0;                              ///< of the last row that was committed
  double lag_s = 0;                                  ///< from its arrival to its commit
  bool caught_up = false;

  /// The reason why no rows are carried; empty if they are.
  const std::string& fault() const { return error.empty() ? rows_error : error; }
};

struct InstanceState {
  std::string socket;
  std::string state = "gone";  ///< "running", "stopped" (systemd would start it for us) or "gone"
  std::string error;
  nlohmann::json status;  ///< the last answer; null while it is not running
};

/// Any thread may call any of these.
class RelayState {
 public:
  /// Says a change on standard error, once.
  void up(const std::string& target);
  void down(const std::string& target, const std::string& why);
  void committed(const std::string& target);
  void dropped(const std::string& target, std::uint64_t count);

  template <class Change>
  void log(const LogKey& key, Change&& change) {
    const std::lock_guard lock(mutex_);
    change(logs_[key]);
  }
  /// Of an instance; a change of its state or error is said, once.
  void instance(const std::string& gyro, const std::string& socket, const std::string& state, const std::string& error);
  void status(const std::string& gyro, nlohmann::json answer);
  void forget(const std::string& gyro);
  /// Logs a name from outside that is not used, once.
  void skipped(const std::string& what, const std::string& why);
  /// The same for an axis whose name breaks the rule.
  void skipped_axis(const std::string& gyro, const std::string& axis);

  struct View {
    std::map<std::string, TargetState> targets;
    std::map<LogKey, LogState> logs;
    std::map<std::string, InstanceState> instances;
  };
  View view() const;

  /// A loop goes round: for the watchdog.
  void progress(std::size_t loop) { progress_[loop] = std::chrono::steady_clock::now().time_since_epoch().count(); }
  /// Whether each of the first `loops` went round within `patience`.
  bool all_progress(std::size_t loops, std::chrono::seconds timeout) const;

 private:
  mutable std::mutex mutex_;
  View view_;
  std::map<LogKey, LogState>& logs_ = view_.logs;
  std::set<std::string> skipped_;
  std::atomic<std::int64_t> progress_[2] = {};
};

/// A line on standard error, printable, with the journal's priority where it reads there.
enum class Level { kError = 3, kWarning = 4, kInfo = 6 };
void say(Level level, const std::string& text);

}  // namespace prism::prismrelay
