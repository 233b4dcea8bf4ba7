// SPDX-License-Identifier: MIT
// The data log: CSV segments, each with a metadata header, synced every second, safe against a full disk.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "base/disk_thread.hpp"
#include "base/sha256.hpp"
#include "compensation/compensated.hpp"
#include "daemon/disk_fault.hpp"
#include "daemon/followers.hpp"
#include "daemon/log_rows.hpp"
#include "daemon/segments.hpp"

namespace prism::daemon {

/// What a log did, of several axes all together; read from any thread.
struct LogCounters {
  std::atomic<std::uint64_t> rows{0}, dropped{0}, segments{0};
  std::atomic<std::uint64_t> pending{0};   ///< rows that wait for the disk thread
  std::atomic<std::uint64_t> unsynced{0};  ///< rows that it wrote, and that a power cut would cost
};

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
  Result<RowPage> page(RowQuery query);
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

/// Where rows are written: on a thread of its own (live), or right here (a replay, which may wait).
class RowWriter {
 public:
  virtual ~RowWriter() = default;
  virtual void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) = 0;
  /// Puts what was appended on the disk; called once a second of real time, however fast the data's time runs.
  virtual void sync() = 0;
  virtual void set_metadata(const std::string& metadata) = 0;
  /// Reads what the disk has. `done` is called on any thread, perhaps before this returns; never where the writer ends
  /// before.
  using Pages = std::function<void(Result<RowPage>)>;
  virtual void read(const RowQuery& query, Pages done) = 0;
  /// Who follows the log by name; null: not known.
  virtual const Followers* followers() const { return nullptr; }
  /// The last segment ends; nothing is taken from here on.
  virtual void close() = 0;
  virtual const LogCounters& counters() const = 0;
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
  const Followers* followers() const override { return log_ ? &log_->followers() : nullptr; }
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

}  // namespace prism::daemon
