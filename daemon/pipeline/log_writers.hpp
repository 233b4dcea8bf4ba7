// SPDX-License-Identifier: MIT
// What the acquisition and the socket know of a log and a capture, wherever and however they are written.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "compensation/compensated.hpp"
#include "daemon/pipeline/row_cursor.hpp"

namespace prism::pipeline {

/// What a log did, of several axes all together; read from any thread.
struct LogCounters {
  std::atomic<std::uint64_t> rows{0}, dropped{0}, segments{0};
  std::atomic<std::uint64_t> pending{0};   ///< rows that wait for the disk thread
  std::atomic<std::uint64_t> unsynced{0};  ///< rows that it wrote, and that a power cut would cost
};

struct RowQuery {
  static constexpr std::size_t kMostRows = 10'000;

  std::string after = {};     ///< a cursor's text, "earliest" or "latest"; empty: the follower's own, else "earliest"
  std::size_t limit = 1000;   ///< 1 to kMostRows
  std::string follower = {};  ///< who asks; empty: nobody who is remembered
  std::uint32_t user = 0;     ///< of the follower
};

/// What the query gets.
struct RowPage {
  /// {"log":…,"segments":[{"segment":…,"file":…,"metadata":{…},"columns":…,"first":…,"rows":[…]}…],"after":…,"more":…,
  /// "missing":…} without its last brace.
  std::string json;
  RowCursor begin, after;  ///< of the query, and behind the last row
  std::size_t rows = 0;
  std::uint64_t missing = 0;  ///< rows behind the query's cursor that were deleted before it asked
};

/// Why a query gets no page.
struct RowRefusal {
  enum class Why {
    kNotAllowed,     ///< another user's follower, or too many followers
    kBadCursor,      ///< no text that `rows` gave
    kForeignCursor,  ///< of another log, or beyond the end of this one
    kUnreadable,     ///< the log cannot be read
  };
  Why why;
  std::string text;  ///< one line
};
using RowResult = tl::expected<RowPage, RowRefusal>;

/// A program that follows the log by a name of its own.
struct FollowerStatus {
  std::uint32_t user = 0;
  RowCursor after;          ///< it has everything up to here
  std::int64_t time_s = 0;  ///< host time of its last request
  std::uint64_t lost_rows = 0;
};

/// Where rows are written: on a thread of its own (live), or right here (a replay, which may wait).
class RowWriter {
 public:
  virtual ~RowWriter() = default;
  virtual void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) = 0;
  /// Puts what was appended on the disk; called once a second of real time, however fast the data's time runs.
  virtual void sync() = 0;
  virtual void set_metadata(const std::string& metadata) = 0;
  /// Reads what the disk has. `done` is called on any thread, perhaps before this returns; never if the writer ends
  /// before.
  using Pages = std::function<void(RowResult)>;
  virtual void read(const RowQuery& query, Pages done) = 0;
  /// By name; empty if not known.
  virtual std::map<std::string, FollowerStatus> followers() const { return {}; }
  /// The last segment ends; nothing is taken from here on.
  virtual void close() = 0;
  virtual const LogCounters& counters() const = 0;
};

/// Where the bytes of one line are kept with their arrival times. No call waits.
class CaptureSink {
 public:
  virtual ~CaptureSink() = default;
  virtual void mark_opened(std::int64_t time_ns) = 0;
  virtual void data(std::span<const std::uint8_t> bytes, std::int64_t time_ns) = 0;
  virtual void flush() = 0;
  virtual std::uint64_t dropped_bytes() const = 0;
};

}  // namespace prism::pipeline
