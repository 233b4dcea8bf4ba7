// SPDX-License-Identifier: MIT
// State of the relay, and its status as JSON, as text and for systemd. One owner, one thread.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "base/problems.hpp"
#include "tools/prismrelay/batch.hpp"

namespace prism::prismrelay {

double host_time_s();

/// Writes a printable line to standard error, with the journal's priority if it is connected to the journal.
enum class Level { kError = 3, kWarning = 4, kInfo = 6 };
void log_line(Level level, const std::string& text);

/// State of PostgreSQL or the broker. Changes are logged.
struct Target {
  std::string name;
  bool is_up = false;
  double since_s = 0;      ///< host time of the last change of `is_up`
  std::string error = {};  ///< of the last failed attempt; empty while up
  std::uint64_t failures = 0, dropped = 0;
  double last_s = 0;  ///< host time of the last commit or acknowledged message

  void up();
  void down(const std::string& reason);
};

/// Progress of one axis' log.
struct LogState {
  std::uint64_t rows = 0, invalid = 0, missing = 0;  ///< since the start of the relay
  std::string error = {};                            ///< error or invalid response of prismd
  std::string rows_error = {};                       ///< set by a page without a valid row, cleared by a valid row
  double arrival_s = 0;                              ///< of the last committed row
  double lag_s = 0;                                  ///< from its arrival to its commit
  bool caught_up = false;

  /// The reason why no rows are sent; empty if rows are sent.
  const std::string& fault() const { return error.empty() ? rows_error : error; }
};

struct GyroState {
  std::string socket;
  std::string state = "new";  ///< then "running", "stopped" (a connection would start it) or "gone"
  std::string error = {};
  nlohmann::json status = {};  ///< the last response to `status`; null if not running
};

struct Report {
  std::string site;
  std::map<std::string, Target> targets;
  std::map<std::string, GyroState> gyros;  ///< by SITE/NAME
  std::map<LogKey, LogState> logs;
};

/// {"format":"prismrelay-status","version":1,"time_s",…,"targets":{…},"instances":{…},"logs":[…]}; without passwords.
nlohmann::json status_json(const Report& report);

/// True if the status is older than 10 s at the time `now_s`: the relay has stopped or stalled.
bool is_stale(const nlohmann::json& status, double now_s);

/// Status for a person, with a warning if it is stale.
std::string status_view(const nlohmann::json& status, double now_s);

/// systemd's status line: "30 of 31 gyros run; mqtt: down: …; postgresql: up, 3 s behind".
std::string summary(const nlohmann::json& status);

}  // namespace prism::prismrelay
