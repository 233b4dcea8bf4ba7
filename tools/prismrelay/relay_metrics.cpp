// SPDX-License-Identifier: MIT
#include "tools/prismrelay/relay_metrics.hpp"

#include "tools/metrics/gyro_metrics.hpp"
#include "tools/prismrelay/report.hpp"

namespace prism::prismrelay {
namespace {

using metrics::Family;
using metrics::Type;

constexpr Family kUp{"prism_relay_up", Type::kGauge, "The relay runs."};
constexpr Family kTargetUp{"prism_relay_target_up", Type::kGauge, "Whether the server is there."};
constexpr Family kFailures{"prism_relay_failures_total", Type::kCounter, "Attempts at the server that failed."};
constexpr Family kDropped{"prism_relay_dropped_messages_total", Type::kCounter,
                          "Messages that the server could not be told."};
constexpr Family kLast{"prism_relay_last_success_timestamp_seconds", Type::kGauge,
                       "When the server last took something, since 1970."};
constexpr Family kRows{"prism_relay_rows_total", Type::kCounter, "Rows that are in the ledger, since the relay runs."};
constexpr Family kRefused{"prism_relay_refused_rows_total", Type::kCounter, "Lines of the log that are no rows."};
constexpr Family kMissing{"prism_relay_missing_rows_total", Type::kCounter,
                          "Rows that were deleted before they were carried."};
constexpr Family kBehind{"prism_relay_behind_seconds", Type::kGauge,
                         "Since the last row that is in the ledger, where further ones wait; else 0."};
constexpr Family kLag{"prism_relay_lag_seconds", Type::kGauge,
                      "From the last row's arrival at the host to its commit."};

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
    out.add(kRefused, labels, static_cast<double>(log.refused));
    out.add(kMissing, labels, static_cast<double>(log.missing));
    out.add(kBehind, labels, behind_s(view, key));
    if (log.arrival_s > 0) out.add(kLag, labels, log.lag_s);
  }
  for (const auto& [gyro, own] : view.instances) metrics::add_gyro(out, gyro, {own.status, {}, {}});
  return out.text();
}

}  // namespace prism::prismrelay
