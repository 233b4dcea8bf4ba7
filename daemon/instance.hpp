// SPDX-License-Identifier: MIT
// What a live run and a replay have alike: the data, what happened, the line's state, and who listens.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/acquisition.hpp"
#include "daemon/event_log.hpp"
#include "daemon/line_status.hpp"
#include "daemon/publisher.hpp"
#include "daemon/row_requests.hpp"

namespace prism::daemon {

/// Hands on what the acquisition returns to those who subscribed. Lives on the live path's thread.
///
/// Clients are told a window once it is in the log, so that a kill takes back nothing that was told; a disk that takes
/// none for a second and more is not waited for.
struct Instance {
  /// `told` hears of every event that is shown, too.
  Instance(pipeline::Setup setup, std::vector<std::unique_ptr<RowWriter>> logs, std::unique_ptr<CaptureLog> capture,
           EventLog::Tell told);

  void begin_session(std::int64_t now_ns) { publish(acquisition.begin_session(now_ns)); }
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
    line.last_data_ns = arrival_ns;
    publish(acquisition.feed(bytes, arrival_ns));
  }
  void clock_set(std::int64_t before_ns, std::int64_t now_ns) { publish(acquisition.clock_set(before_ns, now_ns)); }
  void expire(std::int64_t now_ns) { publish(acquisition.expire(now_ns)); }
  void finish() { publish(acquisition.finish()); }
  void publish(const pipeline::Rows& rows) { publisher.rows(rows, !disk_late_ && acquisition.unwritten()); }
  /// The disk has every row that it was given, or counted it as lost.
  void rows_written();
  /// Once a second and not oftener: windows that the disk has not taken since the last call go out.
  void release_late();
  void tell(Severity severity, const std::string& kind, const std::string& text);
  void set_line(LineState state, const std::string& detail = {});

  const std::int64_t started_ns;
  Publisher publisher;
  EventLog events;
  LineStatus line;
  std::vector<LineStatus> sensor_lines;  ///< as Setup::sensor_lines
  Acquisition acquisition;
  RowRequests row_requests;

 private:
  bool held_ = false, disk_late_ = false;
};

}  // namespace prism::daemon
