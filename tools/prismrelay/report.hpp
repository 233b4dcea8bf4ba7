// SPDX-License-Identifier: MIT
// The relay's state for people and programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismrelay/settings.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// {"format":"prismrelay-status","version":1,"time_s",…,"targets":{…},"instances":{…},"logs":[…]}: no password in it.
nlohmann::ordered_json status_json(const Settings& settings, const RelayState::View& view);

/// The same for a person; `now_s`: a status that is older than 10 s is of a relay that is gone or stands still, and
/// says so.
std::string status_view(const nlohmann::json& status, double now_s);

/// systemd's status line: "30 of 31 gyros; postgresql: up, 0 behind; mqtt: down: …".
std::string summary(const RelayState::View& view);

/// How long the oldest row waits that is not in the ledger: since the last one that is, s; 0 where all are.
double behind_s(const RelayState::View& view, const LogKey& key);

}  // namespace prism::prismrelay
