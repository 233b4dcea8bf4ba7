// SPDX-License-Identifier: MIT
#include "tools/prismrelay/report.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "config/version.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kOld_s = 10;

ordered_json time_or_null(double time_s) { return time_s > 0 ? ordered_json(time_s) : ordered_json(); }

std::string time_text(const json& time_s) {
  if (!time_s.is_number() || !(std::abs(time_s.get<double>()) < 9e15)) return "never";
  return utc_text(static_cast<std::int64_t>(time_s.get<double>()));
}

// The texts of a status file, printable.
std::string text_of(const json& object, const char* key) { return printable(text_member(object, key)); }

std::string target_view(const std::string& name, const json& target) {
  std::string text = fmt::format("{:<12}{} since {}", printable(name), flag_member(target, "up") ? "up" : "DOWN",
                                 time_text(member(target, "since_s")));
  if (const std::string error = text_of(target, "error"); !error.empty()) text += ": " + error;
  if (const auto dropped = count_member(target, "dropped_messages"); dropped > 0)
    text += fmt::format("; {} messages dropped", dropped);
  return text + "\n";
}

std::string log_view(const json& log) {
  const std::string error = text_of(log, "error");
  std::string text =
      fmt::format("{:<24}axis {}: {} rows, ", text_of(log, "gyro"), text_of(log, "axis"), count_member(log, "rows"));
  const double late_s = number_member(log, "behind_s");
  if (error.empty() && flag_member(log, "caught_up")) {
    text += "all there";
  } else if (error.empty() || late_s > 0) {
    text += fmt::format("{:.0f} s behind", late_s);
  } else {
    text += "no row is carried now";
  }
  if (const auto missing = count_member(log, "missing_rows"); missing > 0)
    text += fmt::format(", {} were deleted before", missing);
  if (const auto refused = count_member(log, "refused_rows"); refused > 0)
    text += fmt::format(", {} lines are no rows", refused);
  return text + (error.empty() ? "" : ": " + error) + "\n";
}

}  // namespace

double behind_s(const RelayState::View& view, const LogKey& key) {
  const auto log = view.logs.find(key);
  const auto target = view.targets.find("postgresql");
  if (log == view.logs.end() || target == view.targets.end()) return 0;
  const bool safe = target->second.up && log->second.caught_up && log->second.fault().empty();
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
                             {"caught_up", log.caught_up && log.fault().empty()},
                             {"behind_s", behind_s(view, key)},
                             {"lag_s", log.arrival_s > 0 ? ordered_json(log.lag_s) : ordered_json()},
                             {"last_row_s", time_or_null(log.arrival_s)},
                             {"error", log.fault()}});
  }
  return whole;
}

std::string status_view(const json& status, double now_s) {
  std::string text;
  const double age_s = now_s - number_member(status, "time_s");
  if (age_s > kOld_s)
    text += fmt::format("prismrelay does not run, or stands still: this is of {}, {:.0f} s ago\n",
                        time_text(member(status, "time_s")), age_s);
  text += fmt::format("site        {}\n", text_of(status, "site"));
  for (const auto& [name, target] : member(status, "targets").items()) text += target_view(name, target);
  for (const auto& [gyro, own] : member(status, "instances").items()) {
    const std::string error = text_of(own, "error");
    text += fmt::format("{:<24}{}{}\n", printable(gyro), text_of(own, "state"), error.empty() ? "" : ": " + error);
  }
  for (const json& log : member(status, "logs")) text += log_view(log);
  return text;
}

std::string summary(const RelayState::View& view) {
  const auto running = std::count_if(view.instances.begin(), view.instances.end(),
                                     [](const auto& own) { return own.second.state == "running"; });
  std::string text = fmt::format("{} of {} gyros run", running, view.instances.size());
  double behind = 0;
  std::size_t failing = 0;
  for (const auto& [key, log] : view.logs) {
    behind = std::max(behind, behind_s(view, key));
    failing += log.fault().empty() ? 0 : 1;
  }
  for (const auto& [name, target] : view.targets) {
    text += fmt::format("; {}: {}", name, target.up ? "up" : "down");
    if (!target.error.empty()) text += ": " + target.error;
    if (name == "postgresql" && behind > 0) text += fmt::format(", {:.0f} s behind", behind);
    if (name == "postgresql" && failing > 0) text += ", rows of " + counted(failing, "log") + " fail";
  }
  return text;
}

}  // namespace prism::prismrelay
