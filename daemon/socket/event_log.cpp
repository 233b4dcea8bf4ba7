// SPDX-License-Identifier: MIT
#include "daemon/socket/event_log.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/time_scale.hpp"

namespace prism::socket {

const char* severity_name(Severity severity) {
  constexpr const char* kNames[] = {"debug", "info", "warning", "error"};
  return kNames[static_cast<int>(severity)];
}

namespace {

std::string_view subject(std::string_view kind) { return kind.substr(0, kind.find('_')); }

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

void EventLog::show(Event event) {
  event.json = event_json(event);
  recent_.push_back(std::move(event));
  if (recent_.size() > kKept) recent_.pop_front();
  tell_(recent_.back());
}

// In the order in which they happened.
void EventLog::tell_suppressed(Clock::time_point now, const std::function<bool(const Shown&)>& chosen) {
  std::vector<Shown*> due;
  for (auto& [key, shown] : shown_) {
    if (shown.last.repeats > 0 && chosen(shown)) due.push_back(&shown);
  }
  std::stable_sort(due.begin(), due.end(), [](const Shown* a, const Shown* b) { return a->since < b->since; });
  for (Shown* const shown : due) {
    --shown->last.repeats;
    shown->at = now;
    show(std::exchange(shown->last, {}));
  }
}

void EventLog::tell_late(Clock::time_point now) {
  tell_suppressed(now, [now](const Shown& shown) { return now - shown.at >= scaled(kQuiet); });
}

void EventLog::add(Severity severity, const std::string& kind, const std::string& text, std::int64_t time_ns,
                   Clock::time_point now) {
  const std::string key = kind + '\n' + text;
  const auto known = shown_.find(key);
  Event event{time_ns, severity, kind, text, 0, {}};
  if (known != shown_.end()) {
    event.repeats = known->second.last.repeats;
    if (now - known->second.at < scaled(kQuiet)) {
      ++event.repeats;
      known->second.last = std::move(event);
      known->second.since = now;
      return;
    }
    known->second.last.repeats = 0;
  }
  tell_suppressed(now, [&](const Shown& shown) { return subject(shown.last.kind) == subject(kind); });
  if (shown_.size() >= kKept) shown_.clear();
  shown_[key] = {now, {}, now};
  show(std::move(event));
}

pipeline::Tell EventLog::teller() {
  return [this](Severity severity, const std::string& kind, const std::string& text) {
    add(severity, kind, printable(text), host_time_ns());
  };
}

}  // namespace prism::socket
