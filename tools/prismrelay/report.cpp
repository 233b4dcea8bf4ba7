// SPDX-License-Identifier: MIT
#include "tools/prismrelay/report.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "config/version.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;

constexpr double kMaxAge_s = 10;

json time_or_null(double time_s) { return time_s > 0 ? json(time_s) : json(); }

std::string time_text(const json& time_s) {
  if (!time_s.is_number() || !(std::abs(time_s.get<double>()) < 9e15)) return "never";
  return utc_text(static_cast<std::int64_t>(time_s.get<double>()));
}

// A printable text of a status file.
std::string printable_member(const json& object, const char* key) { return printable(text_member(object, key)); }

// Age of the last committed row if the log may have further rows: the database is down, the log has an error or is not
// read to its end. Else 0, also before the first commit.
double behind_s(const Report& report, const LogState& log) {
  const auto target = report.targets.find("postgresql");
  const bool up_to_date =
      target == report.targets.end() || (target->second.is_up && log.caught_up && log.fault().empty());
  return up_to_date || log.arrival_s == 0 ? 0 : std::max(0.0, host_time_s() - log.arrival_s);
}

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

double host_time_s() { return static_cast<double>(host_time_ns()) * 1e-9; }

void log_line(Level level, const std::string& text) {
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  static constexpr const char* kNames[] = {"", "", "", "error", "warning", "", "info"};
  const int number = static_cast<int>(level);
  if (journal) return fmt::print(stderr, "<{}>{}\n", number, printable(text));
  fmt::print(stderr, "{} prismrelay {}: {}\n", utc_text(static_cast<std::int64_t>(host_time_s())), kNames[number],
             printable(text));
}

void Target::up() {
  error.clear();
  if (std::exchange(is_up, true)) return;
  since_s = host_time_s();
  log_line(Level::kInfo, name + ": connected");
}

void Target::down(const std::string& reason) {
  ++failures;
  if (is_up || since_s == 0) since_s = host_time_s();
  const bool changed = std::exchange(is_up, false) || error != printable(reason);
  error = printable(reason);
  if (changed) log_line(Level::kWarning, reason + "; retrying");
}

json status_json(const Report& report) {
  json status = {{"format", "prismrelay-status"}, {"version", 1},
                 {"program", kVersion},           {"pid", ::getpid()},
                 {"time_s", host_time_s()},       {"site", report.site},
                 {"targets", json::object()},     {"instances", json::object()},
                 {"logs", json::array()}};
  for (const auto& [name, target] : report.targets) {
    status["targets"][name] = {{"up", target.is_up},
                               {"since_s", time_or_null(target.since_s)},
                               {"error", target.error},
                               {"failures", target.failures},
                               {"dropped_messages", target.dropped},
                               {"last_s", time_or_null(target.last_s)}};
  }
  for (const auto& [gyro, one] : report.gyros)
    status["instances"][gyro] = {{"state", one.state}, {"socket", one.socket}, {"error", one.error}};
  for (const auto& [key, log] : report.logs) {
    status["logs"].push_back({{"gyro", key.gyro},
                              {"axis", key.axis},
                              {"rows", log.rows},
                              {"refused_rows", log.invalid},
                              {"missing_rows", log.missing},
                              {"caught_up", log.caught_up && log.fault().empty()},
                              {"behind_s", behind_s(report, log)},
                              {"lag_s", log.arrival_s > 0 ? json(log.lag_s) : json()},
                              {"last_row_s", time_or_null(log.arrival_s)},
                              {"error", log.fault()}});
  }
  return status;
}

bool is_stale(const json& status, double now_s) { return now_s - number_member(status, "time_s") > kMaxAge_s; }

std::string status_view(const json& status, double now_s) {
  std::string text;
  if (is_stale(status, now_s))
    text += fmt::format("prismrelay has stopped or stalled; last status at {}, {:.0f} s ago\n",
                        time_text(member(status, "time_s")), now_s - number_member(status, "time_s"));
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

std::string summary(const json& status) {
  const json& gyros = member(status, "instances");
  const auto running = std::count_if(gyros.begin(), gyros.end(),
                                     [](const json& gyro) { return text_member(gyro, "state") == "running"; });
  std::string text = fmt::format("{} of {} gyros run", running, gyros.size());
  double behind = 0;
  std::size_t failing = 0;
  for (const json& log : member(status, "logs")) {
    behind = std::max(behind, number_member(log, "behind_s"));
    failing += text_member(log, "error").empty() ? 0 : 1;
  }
  for (const auto& [name, target] : member(status, "targets").items()) {
    text += fmt::format("; {}: {}", name, flag_member(target, "up") ? "up" : "down");
    if (const std::string error = text_member(target, "error"); !error.empty()) text += ": " + error;
    if (name == "postgresql" && behind > 0) text += fmt::format(", {:.0f} s behind", behind);
    if (name == "postgresql" && failing > 0) text += ", rows of " + counted(failing, "log") + " fail";
  }
  return text;
}

}  // namespace prism::prismrelay
