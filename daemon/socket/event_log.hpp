// SPDX-License-Identifier: MIT
// Events: sends each one to the log and the clients, and stores the latest for `prismctl events`.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "daemon/pipeline/interfaces.hpp"

namespace prism::socket {

using pipeline::Severity;

struct Event {
  std::int64_t time_ns = 0;  ///< host time, UTC
  Severity severity = Severity::kInfo;
  std::string kind;           ///< event type, a fixed word: line_open, line_lost, model_loaded, …
  std::string text;           ///< one human-readable line
  std::uint64_t repeats = 0;  ///< events of the same type and text suppressed since the last one
  std::string json;           ///< the event as a JSON object, written once for all clients
};

const char* severity_name(Severity severity);

/// Stores the last kKept events. Events of the same type and text within kQuiet are counted, and the last one of them
/// comes late: after kQuiet, or before the next event of its subject (`line` of line_lost), so that the last
/// event that users see of a subject is the last that happened. kQuiet is measured on the monotonic clock, so that a
/// host clock set back suppresses no event.
class EventLog {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kKept = 256;
  static constexpr std::chrono::seconds kQuiet{10};

  using Tell = std::function<void(const Event&)>;
  explicit EventLog(Tell tell) : tell_(std::move(tell)) {}

  /// `time_ns`: time of the event; `now`: time for kQuiet.
  void add(Severity severity, const std::string& kind, const std::string& text, std::int64_t time_ns,
           Clock::time_point now = Clock::now());
  /// Tells suppressed events whose kQuiet has passed. Call it once a second.
  void tell_late(Clock::time_point now = Clock::now());
  /// Returns a callback that adds an event with printable text and the host's time. The log must outlive it.
  pipeline::Tell teller();
  const std::deque<Event>& recent() const { return recent_; }

 private:
  struct Shown {
    Clock::time_point at;
    Event last;               ///< suppressed; its `repeats` counts it, too
    Clock::time_point since;  ///< when the last one was suppressed
  };
  void show(Event event);
  void tell_suppressed(Clock::time_point now, const std::function<bool(const Shown&)>& chosen);

  Tell tell_;
  std::deque<Event> recent_;
  std::map<std::string, Shown> shown_;
};

}  // namespace prism::socket
