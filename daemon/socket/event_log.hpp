// SPDX-License-Identifier: MIT
// What happened: one fault, one line, to the journal, to the clients and kept for `prismctl events`.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "daemon/pipeline/notice.hpp"

namespace prism::socket {

using pipeline::Severity;

struct Event {
  std::int64_t time_ns = 0;  ///< host time, UTC
  Severity severity = Severity::kInfo;
  std::string kind;           ///< one word for programs: line_open, line_lost, model_loaded, …
  std::string text;           ///< one line for people
  std::uint64_t repeats = 0;  ///< the same kind and text, suppressed since it was last shown
  std::string json;           ///< all of it as one JSON object: written once, sent to all who ask
};

const char* severity_name(Severity severity);

/// Keeps the last kKept events. The same kind and text within kQuiet is counted, not shown again. Quiet goes by the
/// monotonic clock: a host clock that is set back by an hour does not silence a fault for an hour.
class EventLog {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kKept = 256;
  static constexpr std::chrono::seconds kQuiet{10};

  using Tell = std::function<void(const Event&)>;
  explicit EventLog(Tell tell) : tell_(std::move(tell)) {}

  /// `time_ns` is what the event says; `now` is what the quieting goes by.
  void add(Severity severity, const std::string& kind, const std::string& text, std::int64_t time_ns,
           Clock::time_point now = Clock::now());
  /// Adds what it is told, printable and with the host's time. Must not outlive the log.
  pipeline::Tell teller();
  const std::deque<Event>& recent() const { return recent_; }

 private:
  Tell tell_;
  std::deque<Event> recent_;
  struct Shown {
    Clock::time_point at;
    std::uint64_t repeats;
  };
  std::map<std::string, Shown> shown_;
};

}  // namespace prism::socket
