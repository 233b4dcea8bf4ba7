// SPDX-License-Identifier: MIT
// Interfaces between the parts of the daemon: events, the log and the capture.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "base/problems.hpp"
#include "compensation/compensated.hpp"
#include "config/socket_protocol.hpp"
#include "daemon/pipeline/stored_segments.hpp"
#include "drivers/capture_file.hpp"

namespace prism::pipeline {

enum class Severity { kDebug, kInfo, kWarning, kError };

/// `kind`: event type, a fixed word (line_open, line_lost, quality, …). `text`: one human-readable line. The receiver
/// adds the time.
using Tell = std::function<void(Severity severity, const std::string& kind, const std::string& text)>;

/// A problem's begin is a warning, its end is information.
inline Problems::Tell problems_as_events(Tell tell) {
  return [tell = std::move(tell)](bool begins, const std::string& kind, const std::string& text) {
    tell(begins ? Severity::kWarning : Severity::kInfo, kind, text);
  };
}

// Status of retention: limits, deletions so far, and the next one.

/// The segment that retention deletes next.
struct NextDeletion {
  enum class Why { kBytes, kAge, kDiskFull };

  std::string file;
  std::uint64_t rows = 0;  ///< 0: not known
  std::int64_t bytes = 0;
  Why why = Why::kBytes;
  std::int64_t in_s = 0;  ///< time until then, expected
};

/// Of one log or capture.
struct RetentionStatus {
  std::uint64_t segments = 0;  ///< files, with the open one
  std::int64_t bytes = 0;
  std::int64_t keep_bytes = 0, keep_s = 0;               ///< the configured limits
  std::uint64_t deleted_segments = 0, deleted_rows = 0;  ///< since the log began
  std::optional<NextDeletion> next;                      ///< nullopt: there is no segment to delete
  std::int64_t uptime_s = 0;                             ///< uptime_s() when this was computed
};

/// Counters of the logs of all axes together; readable on any thread.
struct LogCounters {
  std::atomic<std::uint64_t> rows{0}, dropped{0}, segments{0};
  std::atomic<std::uint64_t> pending{0};   ///< rows queued for the disk thread
  std::atomic<std::uint64_t> gone{0};      ///< rows that a reader asked for and that retention had deleted
  std::atomic<std::uint64_t> unsynced{0};  ///< written rows that a power cut would lose
};

struct RowQuery {
  static constexpr std::size_t kMostRows = 10'000;

  std::string after = {};    ///< a cursor's text, "earliest" or "latest"; empty: "earliest"
  std::size_t limit = 1000;  ///< 1 to kMostRows
  bool header = false;       ///< each segment with the lines above its rows
};

/// Result of a query.
struct RowPage {
  /// {"log":…,"segments":[{"segment":…,"file":…,"metadata":{…},"header":…,"columns":…,"first":…,"rows":[…]}…],"after":…,"more":…,
  /// "missing":…,"behind":…,"kept":…,"deleted":…} without its last brace.
  std::string json;
  RowCursor after;  ///< after the last row
  std::size_t rows = 0;
  std::uint64_t missing = 0;  ///< rows after the query's cursor that were lost: damaged, or removed by hand
};

/// Why a query failed.
struct RowRefusal {
  /// kInvalidParams: the cursor is not one that `rows` returned; kUnknownCursor; kFailed: the log cannot be read;
  /// kRowsGone: the rows after the cursor were deleted, up to `after`.
  config::SocketError code;
  std::string text;        ///< one line
  RowCursor after = {};    ///< kRowsGone: to continue
  std::uint64_t gone = 0;  ///< kRowsGone: number of these rows
};
using RowResult = tl::expected<RowPage, RowRefusal>;

/// Writes rows: on the disk thread (live), or on the caller's (a replay, which may wait).
class RowWriter {
 public:
  virtual ~RowWriter() = default;
  virtual void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) = 0;
  /// Syncs the appended rows. Called once a second of real time, at any speed of the data.
  virtual void sync() = 0;
  virtual void set_metadata(const std::string& metadata) = 0;
  /// Reads written rows. `done` is called on any thread, possibly before this returns; not if the writer is destroyed
  /// first.
  using Pages = std::function<void(RowResult)>;
  virtual void read(const RowQuery& query, Pages done) = 0;
  /// Thread-safe. nullopt: not known yet, or a replay, which deletes nothing.
  virtual std::optional<RetentionStatus> retention() const { return std::nullopt; }
  /// Closes the last segment; later rows are ignored.
  virtual void close() = 0;
  virtual const LogCounters& counters() const = 0;
};

/// Stores the bytes of one line with their arrival times. No call waits.
class CaptureSink {
 public:
  virtual ~CaptureSink() = default;
  /// kOpened has no bytes.
  virtual void record(drivers::CaptureEvent event, std::span<const std::uint8_t> bytes, std::int64_t time_ns) = 0;
  virtual void flush() = 0;
  virtual std::uint64_t dropped_bytes() const = 0;
  /// As RowWriter::retention().
  virtual std::optional<RetentionStatus> retention() const { return std::nullopt; }
};

}  // namespace prism::pipeline
