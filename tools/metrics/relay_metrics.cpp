// SPDX-License-Identifier: MIT
#include "tools/metrics/relay_metrics.hpp"

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

void add_known(Exposition& out, const Family& family, const Labels& labels, const json& value) {
  if (value.is_number()) out.add(family, labels, value.get<double>());
}

}  // namespace

void add_relay(Exposition& out, const json& status) {
  out.add(kRelayUp, {}, 1);
  for (const auto& [name, target] : member(status, "targets").items()) {
    const Labels labels = {{"target", name}};
    out.add(kRelayTargetUp, labels, flag_member(target, "up"));
    add_known(out, kRelayFailures, labels, member(target, "failures"));
    add_known(out, kRelayDropped, labels, member(target, "dropped_messages"));
    add_known(out, kRelayLast, labels, member(target, "last_s"));
  }
  for (const json& log : member(status, "logs")) {
    const Labels labels = {{"gyro", text_member(log, "gyro")}, {"axis", text_member(log, "axis")}};
    add_known(out, kRelayRows, labels, member(log, "rows"));
    add_known(out, kRelayRefused, labels, member(log, "refused_rows"));
    add_known(out, kRelayMissing, labels, member(log, "missing_rows"));
    add_known(out, kRelayBehind, labels, member(log, "behind_s"));
    add_known(out, kRelayLag, labels, member(log, "lag_s"));
  }
}

}  // namespace prism::metrics
