// SPDX-License-Identifier: MIT
#include "tools/prismrelay/relay_metrics.hpp"

#include "tools/metrics/gyro_metrics.hpp"
#include "tools/prismrelay/report.hpp"

namespace prism::prismrelay {
namespace {

using metrics::Family;
using metrics::Type;

constexpr Family kUp{"prism_relay_up", Type::kGauge, "1: the relay is running."};
constexpr Family kTargetUp{"prism_relay_target_up", Type::kGauge, "1 if the server is connected, else 0."};
constexpr Family kFailures{"prism_relay_failures_total", Type::kCounter,
                           "Failed connections and operations of the server."};
constexpr Family kDropped{"prism_relay_dropped_messages_total", Type::kCounter, "Messages dropped instead of sent."};
constexpr Family kLast{"prism_relay_last_success_timestamp_seconds", Type::kGauge,
                       "Unix time of the last commit or acknowledged message."};
constexpr Family kRows{"prism_relay_rows_total", Type::kCounter, "Rows committed since the relay started."};
constexpr Family kRefused{"prism_relay_refused_rows_total", Type::kCounter, "Invalid lines of the log."};
constexpr Family kMissing{"prism_relay_missing_rows_total", Type::kCounter, "Rows deleted before they were sent."};
constexpr Family kBehind{"prism_relay_behind_seconds", Type::kGauge,
                         "Age of the last committed row if further rows may wait, else 0."};
constexpr Family kLag{"prism_relay_lag_seconds", Type::kGauge,
                      "Time from the arrival of the last row at the host to its commit."};

}  // namespace

std::string metrics_text(const RelayState::View& view) {
  metrics::Exposition out;
  out.add(kUp, {}, 1);
  metrics::add_time(out, host_time_s());
  for (const auto& [name, target] : view.targets) {
    const metrics::Labels labels = {{"target", name}};
    out.add(kTargetUp, labels, target.up);
    out.add(kFailures, labels, static_cast<double>(target.failures));
    out.add(kDropped, labels, static_cast<double>(target.dropped));
    if (target.committed_s > 0) out.add(kLast, labels, target.committed_s);
  }
  for (const auto& [key, log] : view.logs) {
    const metrics::Labels labels = {{"gyro", key.gyro}, {"axis", key.axis}};
    out.add(kRows, labels, static_cast<double>(log.rows));
    out.add(kRefused, labels, static_cast<double>(log.invalid));
    out.add(kMissing, labels, static_cast<double>(log.missing));
    out.add(kBehind, labels, behind_s(view, key));
    if (log.arrival_s > 0) out.add(kLag, labels, log.lag_s);
  }
  for (const auto& [gyro, instance] : view.instances) metrics::add_gyro(out, gyro, {instance.status, {}, {}});
  return out.text();
}

}  // namespace prism::prismrelay
