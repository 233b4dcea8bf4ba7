// SPDX-License-Identifier: MIT
// The data log: CSV segments, each with a metadata header, synced every second, safe against a full disk.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "base/disk_thread.hpp"
#include "base/sha256.hpp"
#include "compensation/compensated.hpp"
#include "daemon/log/disk_fault.hpp"
#include "daemon/log/followers.hpp"
#include "daemon/log/log_rows.hpp"
#include "daemon/log/segments.hpp"
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

using pipeline::FollowerStatus, pipeline::LogCounters, pipeline::RowPage, pipeline::RowQuery, pipeline::RowResult,
    pipeline::RowWriter;

/// Writes rows where the caller's thread may wait: live it runs on the disk thread, in a replay on the main one.
/// A row is there whole or not at all: after a failed write the file is cut back to its last whole row.
///
/// After a failed sync the system may have thrown away what was not on the disk, and will not say so again: the segment
/// is given up, and the rows since the last good sync are written again into a new one, which names the row from which
/// it supersedes the old one. As long as that fails, too, they are kept here, kMostUnsynced of them, and tried again at
/// growing pauses.
class RowLog {
 public:
  /// `metadata`: lines "# key: value\n" that stand on top of every segment, before its session. `tell` hears of faults,
  /// one line each, once per fault and once when it is over.
  RowLog(config::SegmentSettings settings, std::string name, std::string metadata, LogCounters& counters,
         DiskFault::Tell tell);
  ~RowLog();
  RowLog(const RowLog&) = delete;
  RowLog& operator=(const RowLog&) = delete;

  /// `session_ns`: the arrival time at which the row's session began; another one than the row before begins a segment.
  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns);
  /// Puts what was appended on the disk (fdatasync). A segment that was deleted or moved away meanwhile ends.
  void sync();
  /// Ends the segment; what no disk took until now is dropped and counted.
  void close();
  /// From the next row on, segments carry this metadata; the open one ends.
  void set_metadata(std::string metadata);
  /// Rows that stand on the disk, by their places (LogRows).
  RowResult page(RowQuery query);
  const Followers& followers() const { return followers_; }
  /// A row that could not even be given to append(): `why` is told. From any thread.
  void lose(const std::string& why);

 private:
  struct Row {
    std::int64_t second, session_ns;
    std::string line;
  };
  static constexpr std::size_t kMostUnsynced = 3600;

  void write_row(Row row);
  bool open_segment(std::int64_t second);
  void close_segment();
  bool put_on_disk();
  void count_unsynced();
  void distrust();
  void write_again();
  void write_end();
  bool write_all(const std::string& text);

  std::string metadata_;
  LogCounters& counters_;
  DiskFault::Tell tell_;
  DiskFault fault_;
  Segments segments_;
  LogRows log_rows_{segments_};
  Followers followers_;
  std::uint64_t synced_rows_ = 0;  // of the open segment
  std::string path_, superseded_;  // "FILE from row N", until its rows stand elsewhere
  std::deque<Row> unsynced_;       // as far back as kMostUnsynced
  std::uint64_t counted_unsynced_ = 0;
  bool distrusted_ = false;  // unsynced_ waits for a new segment
  RetryPause pause_;         // in syncs
  int file_ = -1;
  std::int64_t bytes_ = 0, session_ns_ = 0;
  std::uint64_t rows_ = 0;  // in the segment
  Sha256 sum_;              // of the segment so far
  bool torn_ = false;       // something stands in it that sum_ does not know
};

/// Never waits: rows and syncs are posted. Rows that the queue cannot take are dropped and counted.
/// `written` is called on the disk thread when no row of `counters`, which several may share, waits for it any more.
class ThreadedRowWriter : public RowWriter {
 public:
  /// As RowLog's; `tell` is called on any thread.
  using Written = std::function<void()>;
  /// `synced` is called on the disk thread after each sync.
  ThreadedRowWriter(
      config::SegmentSettings settings, std::string name, std::string metadata, DiskThread& disk, DiskFault::Tell tell,
      Written written, std::shared_ptr<LogCounters> counters = std::make_shared<LogCounters>(), Written synced = [] {});
  ~ThreadedRowWriter() override;

  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) override;
  void sync() override;
  void set_metadata(const std::string& metadata) override;
  void read(const RowQuery& query, Pages done) override;
  std::map<std::string, FollowerStatus> followers() const override {
    return log_ ? log_->followers().status() : std::map<std::string, FollowerStatus>();
  }
  void close() override;
  const LogCounters& counters() const override { return *counters_; }

 private:
  DiskThread& disk_;
  std::shared_ptr<LogCounters> counters_;
  std::shared_ptr<RowLog> log_;
  const Written written_, synced_;
  bool unsynced_ = false;
};

/// Waits for the disk: a replay loses nothing. The first fault is kept.
class DirectRowWriter : public RowWriter {
 public:
  DirectRowWriter(config::SegmentSettings settings, std::string name, std::string metadata,
                  std::shared_ptr<LogCounters> counters = std::make_shared<LogCounters>());

  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) override {
    log_.append(row, session_ns);
  }
  void sync() override {}  // a replay can be run again; the segment is synced when it closes
  void set_metadata(const std::string& metadata) override { log_.set_metadata(metadata); }
  void read(const RowQuery& query, Pages done) override { done(log_.page(query)); }
  void close() override { log_.close(); }
  const LogCounters& counters() const override { return *counters_; }
  const std::string& first_fault() const { return first_fault_; }

 private:
  std::shared_ptr<LogCounters> counters_;
  std::string first_fault_;
  RowLog log_;
};

}  // namespace prism::log
