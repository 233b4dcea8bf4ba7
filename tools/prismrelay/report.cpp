// SPDX-License-Identifier: MIT
#include "tools/prismrelay/report.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "config/version.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kMaxAge_s = 10;

ordered_json time_or_null(double time_s) { return time_s > 0 ? ordered_json(time_s) : ordered_json(); }

std::string time_text(const json& time_s) {
  if (!time_s.is_number() || !(std::abs(time_s.get<double>()) < 9e15)) return "never";
  return utc_text(static_cast<std::int64_t>(time_s.get<double>()));
}

// A printable text of a status file.
std::string printable_member(const json& object, const char* key) { return printable(text_member(object, key)); }

std::string target_view(const std::string& name, const json& target) {
  std::string text = fmt::format("{:<12}{} since {}", printable(name), flag_member(target, "up") ? "up" : "DOWN",
                                 time_text(member(target, "since_s")));
  if (const std::string error = printable_member(target, "error"); !error.empty()) text += ": " + error;
  if (const auto dropped = count_member(target, "dropped_messages"); dropped > 0)
    text += fmt::format("; {} messages dropped", dropped);
  return text + "\n";
}

std::string log_view(const json& log) {
  const std::string error = printable_member(log, "error");
  std::string text = fmt::format("{:<24}axis {}: {} rows, ", printable_member(log, "gyro"),
                                 printable_member(log, "axis"), count_member(log, "rows"));
  const double late_s = number_member(log, "behind_s");
  if (error.empty() && flag_member(log, "caught_up")) {
    text += "up to date";
  } else if (error.empty() || late_s > 0) {
    text += fmt::format("{:.0f} s behind", late_s);
  } else {
    text += "not sending";
  }
  if (const auto missing = count_member(log, "missing_rows"); missing > 0)
    text += ", " + counted(missing, "row") + " deleted before sending";
  if (const auto invalid = count_member(log, "refused_rows"); invalid > 0)
    text += ", " + counted(invalid, "invalid line");
  return text + (error.empty() ? "" : ": " + error) + "\n";
}

}  // namespace

double behind_s(const RelayState::View& view, const LogKey& key) {
  const auto log = view.logs.find(key);
  const auto target = view.targets.find("postgresql");
  if (log == view.logs.end() || target == view.targets.end()) return 0;
  const bool up_to_date = target->second.up && log->second.caught_up && log->second.fault().empty();
  return up_to_date || log->second.arrival_s == 0 ? 0 : std::max(0.0, host_time_s() - log->second.arrival_s);
}

ordered_json status_json(const Settings& settings, const RelayState::View& view) {
  ordered_json status = {{"format", "prismrelay-status"}, {"version", 1},
                         {"program", kVersion},           {"pid", ::getpid()},
                         {"time_s", host_time_s()},       {"site", settings.site}};
  status["targets"] = ordered_json::object();
  for (const auto& [name, target] : view.targets) {
    status["targets"][name] = {{"up", target.up},
                               {"since_s", time_or_null(target.since_s)},
                               {"error", target.error},
                               {"failures", target.failures},
                               {"dropped_messages", target.dropped},
                               {"last_s", time_or_null(target.committed_s)}};
  }
  status["instances"] = ordered_json::object();
  for (const auto& [gyro, instance] : view.instances)
    status["instances"][gyro] = {{"state", instance.state}, {"socket", instance.socket}, {"error", instance.error}};
  status["logs"] = ordered_json::array();
  for (const auto& [key, log] : view.logs) {
    status["logs"].push_back({{"gyro", key.gyro},
                              {"axis", key.axis},
                              {"rows", log.rows},
                              {"refused_rows", log.invalid},
                              {"missing_rows", log.missing},
                              {"caught_up", log.caught_up && log.fault().empty()},
                              {"behind_s", behind_s(view, key)},
                              {"lag_s", log.arrival_s > 0 ? ordered_json(log.lag_s) : ordered_json()},
                              {"last_row_s", time_or_null(log.arrival_s)},
                              {"error", log.fault()}});
  }
  return status;
}

std::string status_view(const json& status, double now_s) {
  std::string text;
  const double age_s = now_s - number_member(status, "time_s");
  if (age_s > kMaxAge_s)
    text += fmt::format("prismrelay has stopped or stalled; last status at {}, {:.0f} s ago\n",
                        time_text(member(status, "time_s")), age_s);
  text += fmt::format("site        {}\n", printable_member(status, "site"));
  for (const auto& [name, target] : member(status, "targets").items()) text += target_view(name, target);
  for (const auto& [gyro, instance] : member(status, "instances").items()) {
    const std::string error = printable_member(instance, "error");
    text += fmt::format("{:<24}{}{}\n", printable(gyro), printable_member(instance, "state"),
                        error.empty() ? "" : ": " + error);
  }
  for (const json& log : member(status, "logs")) text += log_view(log);
  return text;
}

std::string summary(const RelayState::View& view) {
  const auto running = std::count_if(view.instances.begin(), view.instances.end(),
                                     [](const auto& instance) { return instance.second.state == "running"; });
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
