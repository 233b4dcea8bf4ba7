// SPDX-License-Identifier: MIT
// The families of metrics: of each prismd and each relay of a host.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/metrics/exposition.hpp"

namespace prism::metrics {

/// Responses of a prismd (docs/protocol.md); null: not requested, or no response.
struct GyroAnswers {
  nlohmann::json status, line, stability;
};

/// Adds the metrics of one prismd; `gyro` is the label of this name. Without a status, only prism_up 0: old values are
/// not repeated. Null values have no sample.
void add_gyro(Exposition& exposition, const std::string& gyro, const GyroAnswers& answers);

/// A relay whose status is older at the time `now_s` has stopped or stalled.
inline constexpr std::int64_t kRelayTimeout_s = 10;

/// Adds the metrics of a relay from its status (the file that `prismrelay --status` reads). If it does not run, only
/// prism_relay_up 0.
void add_relay(Exposition& exposition, const nlohmann::json& status, double now_s);

/// Adds the metrics of the relays of this host: those with a status in config::relay_status_files().
void add_relays(Exposition& exposition);

/// Adds the time of writing, so that an old file can be detected.
void add_time(Exposition& exposition);

}  // namespace prism::metrics
