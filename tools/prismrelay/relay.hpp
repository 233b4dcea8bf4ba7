// SPDX-License-Identifier: MIT
// The relay: one loop that follows every gyro of the host. The database has its own thread.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Writes a printable line to standard error, with the journal's priority if it is connected to the journal.
enum class Level { kWarning = 4, kInfo = 6 };
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
  nlohmann::json status() const;
  std::string text() const;  ///< "; mqtt: down: connection refused"
};

/// Runs until SIGTERM or SIGINT.
void run_relay(const Settings& settings);

}  // namespace prism::prismrelay
