// SPDX-License-Identifier: MIT
// What a live run and a replay have alike: the data, what happened, the line's state, and who listens.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "daemon/acquisition.hpp"
#include "daemon/event_log.hpp"
#include "daemon/line_status.hpp"
#include "daemon/publisher.hpp"

namespace prism::daemon {

/// Hands on what the acquisition returns to those who subscribed. Lives on the live path's thread.
struct Instance {
  /// `told` hears of every event that is shown, too.
  Instance(pipeline::Setup setup, std::unique_ptr<RowWriter> log, std::unique_ptr<CaptureLog> capture,
           EventLog::Tell told);

  void begin_session(std::int64_t now_ns) { publisher.rows(acquisition.begin_session(now_ns)); }
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
    line.last_data_ns = arrival_ns;
    publisher.rows(acquisition.feed(bytes, arrival_ns));
  }
  void expire(std::int64_t now_ns) { publisher.rows(acquisition.expire(now_ns)); }
  void finish() { publisher.rows(acquisition.finish()); }
  void tell(Severity severity, const std::string& kind, const std::string& text);
  void set_line(LineState state, const std::string& detail = {});

  const std::int64_t started_ns;
  Publisher publisher;
  EventLog events;
  LineStatus line;
  Acquisition acquisition;
};

}  // namespace prism::daemon
