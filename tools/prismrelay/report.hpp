// SPDX-License-Identifier: MIT
// Status of the relay, as JSON and human-readable.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismrelay/settings.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// {"format":"prismrelay-status","version":1,"time_s",…,"targets":{…},"instances":{…},"logs":[…]}; without passwords.
nlohmann::ordered_json status_json(const Settings& settings, const RelayState::View& view);

/// Human-readable status, with a warning if it is older than 10 s at the time `now_s`: the relay has stopped or
/// stalled.
std::string status_view(const nlohmann::json& status, double now_s);

/// systemd's status line: "30 of 31 gyros run; mqtt: down: …; postgresql: up, 3 s behind".
std::string summary(const RelayState::View& view);

/// Age of the last committed row, s, if the log may have further rows: the database is down, the log has an error or is
/// not read to its end. Else 0, also before the first commit.
double behind_s(const RelayState::View& view, const LogKey& key);

}  // namespace prism::prismrelay
