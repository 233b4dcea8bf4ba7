// SPDX-License-Identifier: MIT
#include "daemon/socket/event_log.hpp"

#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/host_time.hpp"

namespace prism::socket {

const char* severity_name(Severity severity) {
  constexpr const char* kNames[] = {"debug", "info", "warning", "error"};
  return kNames[static_cast<int>(severity)];
}

namespace {

std::string event_json(const Event& event) {
  const std::int64_t whole_ms = event.time_ns / 1'000'000;
  nlohmann::ordered_json json = {{"time_s", static_cast<double>(whole_ms) / 1000},
                                 {"severity", severity_name(event.severity)},
                                 {"kind", event.kind},
                                 {"text", event.text}};
  if (event.repeats > 0) json["repeats"] = event.repeats;
  return json_text(json);
}

}  // namespace

void EventLog::add(Severity severity, const std::string& kind, const std::string& text, std::int64_t time_ns,
                   Clock::time_point now) {
  const std::string key = kind + '\n' + text;
  const auto known = shown_.find(key);
  std::uint64_t repeats = 0;
  if (known != shown_.end()) {
    if (now - known->second.at < kQuiet) {
      ++known->second.repeats;
      return;
    }
    repeats = known->second.repeats;
  }
  if (shown_.size() >= kKept) shown_.clear();
  shown_[key] = {now, 0};
  recent_.push_back({time_ns, severity, kind, text, repeats, {}});
  recent_.back().json = event_json(recent_.back());
  if (recent_.size() > kKept) recent_.pop_front();
  tell_(recent_.back());
}

pipeline::Tell EventLog::teller() {
  return [this](Severity severity, const std::string& kind, const std::string& text) {
    add(severity, kind, printable(text), host_time_ns());
  };
}

}  // namespace prism::socket
