// SPDX-License-Identifier: MIT
#include "tools/prismrelay/report.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "base/text_number.hpp"
#include "config/version.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kOld_s = 10;

ordered_json time_or_null(double time_s) { return time_s > 0 ? ordered_json(time_s) : ordered_json(); }

std::string time_text(const json& time_s) {
  return time_s.is_number() ? utc_text(static_cast<std::int64_t>(time_s.get<double>())) : "never";
}

std::string target_view(const std::string& name, const json& target) {
  std::string text = fmt::format("{:<12}{} since {}", name, target.value("up", false) ? "up" : "DOWN",
                                 time_text(target.value("since_s", json())));
  if (const std::string error = target.value("error", ""); !error.empty()) text += ": " + error;
  if (const auto dropped = target.value("dropped_messages", 0); dropped > 0)
    text += fmt::format("; {} messages dropped", dropped);
  return text + "\n";
}

}  // namespace

double behind_s(const RelayState::View& view, const LogKey& key) {
  const auto log = view.logs.find(key);
  const auto target = view.targets.find("postgresql");
  if (log == view.logs.end() || target == view.targets.end()) return 0;
  const bool safe = target->second.up && log->second.caught_up && log->second.error.empty();
  return safe || log->second.arrival_s == 0 ? 0 : std::max(0.0, host_time_s() - log->second.arrival_s);
}

ordered_json status_json(const Settings& settings, const RelayState::View& view) {
  ordered_json whole = {{"format", "prismrelay-status"}, {"version", 1},
                        {"program", kVersion},           {"pid", ::getpid()},
                        {"time_s", host_time_s()},       {"site", settings.site}};
  whole["targets"] = ordered_json::object();
  for (const auto& [name, target] : view.targets) {
    whole["targets"][name] = {{"up", target.up},
                              {"since_s", time_or_null(target.since_s)},
                              {"error", target.error},
                              {"failures", target.failures},
                              {"dropped_messages", target.dropped},
                              {"last_s", time_or_null(target.committed_s)}};
  }
  whole["instances"] = ordered_json::object();
  for (const auto& [gyro, own] : view.instances)
    whole["instances"][gyro] = {{"state", own.state}, {"socket", own.socket}, {"error", own.error}};
  whole["logs"] = ordered_json::array();
  for (const auto& [key, log] : view.logs) {
    whole["logs"].push_back({{"gyro", key.gyro},
                             {"axis", key.axis},
                             {"rows", log.rows},
                             {"refused_rows", log.refused},
                             {"missing_rows", log.missing},
                             {"caught_up", log.caught_up},
                             {"behind_s", behind_s(view, key)},
                             {"lag_s", log.arrival_s > 0 ? ordered_json(log.lag_s) : ordered_json()},
                             {"last_row_s", time_or_null(log.arrival_s)},
                             {"error", log.error}});
  }
  return whole;
}

std::string status_view(const json& status, double now_s) {
  std::string text;
  const double age_s = now_s - status.value("time_s", 0.0);
  if (age_s > kOld_s)
    text += fmt::format("prismrelay does not run, or stands still: this is of {}, {:.0f} s ago\n",
                        time_text(status.value("time_s", json())), age_s);
  text += fmt::format("site        {}\n", status.value("site", ""));
  const json targets = status.value("targets", json::object()), instances = status.value("instances", json::object());
  for (const auto& [name, target] : targets.items()) text += target_view(name, target);
  for (const auto& [gyro, own] : instances.items()) {
    const std::string error = own.value("error", "");
    text += fmt::format("{:<24}{}{}\n", gyro, own.value("state", ""), error.empty() ? "" : ": " + error);
  }
  const json logs = status.value("logs", json::array());
  for (const json& log : logs) {
    text +=
        fmt::format("{:<24}axis {}: {} rows, ", log.value("gyro", ""), log.value("axis", ""), log.value("rows", 0ULL));
    text += log.value("caught_up", false) ? "all there" : fmt::format("{:.0f} s behind", log.value("behind_s", 0.0));
    if (const auto missing = log.value("missing_rows", 0ULL); missing > 0)
      text += fmt::format(", {} were deleted before", missing);
    if (const auto refused = log.value("refused_rows", 0ULL); refused > 0)
      text += fmt::format(", {} lines are no rows", refused);
    if (const std::string error = log.value("error", ""); !error.empty()) text += ": " + error;
    text += "\n";
  }
  return text;
}

std::string summary(const RelayState::View& view) {
  const auto running = std::count_if(view.instances.begin(), view.instances.end(),
                                     [](const auto& own) { return own.second.state == "running"; });
  std::string text = fmt::format("{} of {} gyros run", running, view.instances.size());
  double behind = 0;
  for (const auto& [key, log] : view.logs) behind = std::max(behind, behind_s(view, key));
  for (const auto& [name, target] : view.targets) {
    text += fmt::format("; {}: {}", name, target.up ? "up" : "down");
    if (!target.error.empty()) text += ": " + target.error;
    if (name == "postgresql" && behind > 0) text += fmt::format(", {:.0f} s behind", behind);
  }
  return text;
}

}  // namespace prism::prismrelay
