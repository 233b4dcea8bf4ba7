// SPDX-License-Identifier: MIT
#include "tools/metrics/relay_metrics.hpp"

#include <limits>

#include "base/json_member.hpp"

namespace prism::metrics {
namespace {

using nlohmann::json;

constexpr Family kRelayUp{"prism_relay_up", Type::kGauge, "1: the relay is running."};
constexpr Family kRelayTargetUp{"prism_relay_target_up", Type::kGauge, "1 if the server is connected, else 0."};
constexpr Family kRelayFailures{"prism_relay_failures_total", Type::kCounter,
                                "Failed connections and operations of the server."};
constexpr Family kRelayDropped{"prism_relay_dropped_messages_total", Type::kCounter,
                               "Messages dropped instead of sent."};
constexpr Family kRelayLast{"prism_relay_last_success_timestamp_seconds", Type::kGauge,
                            "Unix time of the last commit or acknowledged message."};
constexpr Family kRelayRows{"prism_relay_rows_total", Type::kCounter, "Rows committed since the relay started."};
constexpr Family kRelayRefused{"prism_relay_refused_rows_total", Type::kCounter, "Invalid lines of the log."};
constexpr Family kRelayMissing{"prism_relay_missing_rows_total", Type::kCounter, "Rows deleted before they were sent."};
constexpr Family kRelayBehind{"prism_relay_behind_seconds", Type::kGauge,
                              "Age of the last committed row if further rows may wait, else 0."};
constexpr Family kRelayLag{"prism_relay_lag_seconds", Type::kGauge,
                           "Time from the arrival of the last row at the host to its commit."};

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();  // add() leaves it out

}  // namespace

void add_relay(Exposition& out, const json& status) {
  out.add(kRelayUp, {}, 1);
  for (const auto& [name, target] : member(status, "targets").items()) {
    const Labels labels = {{"target", name}};
    out.add(kRelayTargetUp, labels, flag_member(target, "up"));
    out.add(kRelayFailures, labels, number_member(target, "failures", kAbsent));
    out.add(kRelayDropped, labels, number_member(target, "dropped_messages", kAbsent));
    out.add(kRelayLast, labels, number_member(target, "last_s", kAbsent));
  }
  for (const json& log : member(status, "logs")) {
    const Labels labels = {{"gyro", text_member(log, "gyro")}, {"axis", text_member(log, "axis")}};
    out.add(kRelayRows, labels, number_member(log, "rows", kAbsent));
    out.add(kRelayRefused, labels, number_member(log, "refused_rows", kAbsent));
    out.add(kRelayMissing, labels, number_member(log, "missing_rows", kAbsent));
    out.add(kRelayBehind, labels, number_member(log, "behind_s", kAbsent));
    out.add(kRelayLag, labels, number_member(log, "lag_s", kAbsent));
  }
}

}  // namespace prism::metrics
