// SPDX-License-Identifier: MIT
// The data log: CSV segments, each with a metadata header, synced every second, safe against a full disk.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "compensation/compensated.hpp"
#include "daemon/segments.hpp"

namespace prism::daemon {

/// What a log did; read from any thread.
struct LogCounters {
  std::atomic<std::uint64_t> rows{0}, dropped{0}, segments{0};
};

/// Writes rows where the caller's thread may wait: live it runs on the disk thread, in a replay on the main one.
/// A row is there whole or not at all: after a failed write the file is cut back to its last whole row.
class RowLog {
 public:
  /// `metadata`: lines "# key: value\n" that stand on top of every segment. `tell` hears of faults, one line each,
  /// once per fault and once when it is over.
  RowLog(config::SegmentSettings settings, std::string name, std::string metadata, LogCounters& counters,
         std::function<void(const std::string&)> tell);
  ~RowLog();
  RowLog(const RowLog&) = delete;
  RowLog& operator=(const RowLog&) = delete;

  void append(const compensation::CompensatedWindow& row);
  /// Puts what was appended on the disk (fdatasync).
  void sync();
  /// From the next row on, segments carry this metadata; the open one ends.
  void set_metadata(std::string metadata);

 private:
  bool open_segment(std::int64_t second);
  void close_segment();
  bool write_all(const std::string& text);
  void fault(const std::string& what);
  void recovered();

  config::SegmentSettings settings_;
  std::string name_, metadata_;
  LogCounters& counters_;
  std::function<void(const std::string&)> tell_;
  SegmentClock clock_;
  std::string path_, line_;
  int file_ = -1;
  std::int64_t bytes_ = 0;
  bool faulty_ = false;
  std::uint64_t dropped_in_fault_ = 0;
};

/// Where rows are written: on a thread of its own (live), or right here (a replay, which may wait).
class RowWriter {
 public:
  virtual ~RowWriter() = default;
  virtual void append(const compensation::CompensatedWindow& row) = 0;
  /// Puts what was appended on the disk; called once a second of real time, however fast the data's time runs.
  virtual void sync() = 0;
  virtual void set_metadata(const std::string& metadata) = 0;
  virtual const LogCounters& counters() const = 0;
};

}  // namespace prism::daemon
