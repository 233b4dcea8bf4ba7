// SPDX-License-Identifier: MIT
// The data log: CSV segments with a metadata header, synced every second; a full disk damages no row.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/disk_thread.hpp"
#include "base/sha256.hpp"
#include "compensation/compensated.hpp"
#include "daemon/log/log_pager.hpp"
#include "daemon/log/segments.hpp"
#include "daemon/pipeline/interfaces.hpp"
#include "daemon/pipeline/setup.hpp"

namespace prism::log {

using pipeline::LogCounters, pipeline::RowPage, pipeline::RowQuery, pipeline::RowResult, pipeline::RowWriter;

/// Writes rows on the caller's thread and may wait: on the disk thread when live, on the main thread in a replay. After
/// a failed write the file is truncated to its last complete row.
///
/// After a failed sync the kernel may have discarded unwritten pages, and it reports this only once. The segment is
/// closed, and the rows since the last successful sync are written again to a new one. Its header states from which row
/// it supersedes the old segment. While this fails, up to kMostUnsynced rows are kept in memory and retried at growing
/// intervals.
class RowLog {
 public:
  /// `metadata`: lines "# key: value\n" at the top of each segment, before its session. `problems` must outlive
  /// this.
  RowLog(config::LogSegmentSettings settings, std::string name, std::string metadata, LogCounters& counters,
         Problems& problems, const SegmentPolicy& policy = {});
  ~RowLog();
  RowLog(const RowLog&) = delete;
  RowLog& operator=(const RowLog&) = delete;

  /// `session_ns`: arrival time at which the row's session began. If it changes, a new segment begins.
  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns);
  /// Syncs the appended rows (fdatasync), and deletes old segments (Segments::retain). Closes the segment if its file
  /// was deleted or moved. Call about once a second, also without new rows; never in a replay.
  void sync();
  /// Closes the segment. Rows that cannot be written are dropped and counted.
  void close();
  /// Closes the segment; later segments have this metadata.
  void set_metadata(std::string metadata);
  /// Returns synced rows from a cursor on (LogPager).
  RowResult page(const RowQuery& query);
  /// Thread-safe.
  std::optional<pipeline::RetentionStatus> retention() const { return segments_.retention(); }
  /// Counts a row that could not be passed to append(), and reports `why`. Thread-safe.
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
  void leave_segment(std::uint64_t rows);
  bool put_on_disk();
  void count_unsynced();
  void distrust();
  void write_again();
  void write_end();
  bool write_all(const std::string& text);

  std::string metadata_;
  LogCounters& counters_;
  WriteFault fault_;
  Segments segments_;
  LogPager log_rows_{segments_};
  std::uint64_t synced_rows_ = 0;  // of the open segment
  std::string late_;               // the last cursor whose next rows were deleted
  std::string path_, superseded_;  // "FILE from row N", until these rows are written again
  std::deque<Row> unsynced_;       // at most kMostUnsynced
  std::uint64_t counted_unsynced_ = 0;
  bool distrusted_ = false;   // unsynced_ is to be written to a new segment
  ExponentialBackoff pause_;  // in syncs
  int file_ = -1;
  std::int64_t bytes_ = 0, session_ns_ = 0;
  std::uint64_t rows_ = 0;  // in the segment
  Sha256 sum_;              // of the open segment
  bool torn_ = false;       // the file contains bytes that are not in sum_
};

/// With a disk thread: never waits. Rows and syncs are posted to it; if its queue is full, rows are dropped and
/// counted. Without one: writes on the caller's thread, so that a replay loses no row.
class LogWriter : public RowWriter {
 public:
  /// Called on the disk thread: `written` when no row of the counters (which several writers may share) is pending,
  /// `synced` after each sync.
  struct Owner {
    std::function<void()> written = [] {}, synced = [] {};
  };
  /// Arguments as for RowLog; `problems` must outlive the disk thread, if there is one.
  LogWriter(config::LogSegmentSettings settings, std::string name, std::string metadata, DiskThread* disk,
            Problems& problems, Owner owner, std::shared_ptr<LogCounters> counters = std::make_shared<LogCounters>(),
            const SegmentPolicy& policy = {});
  ~LogWriter() override { close(); }

  void append(const compensation::CompensatedWindow& row, std::int64_t session_ns) override;
  void sync() override;
  void set_metadata(const std::string& metadata) override;
  void read(const RowQuery& query, Pages done) override;
  std::optional<pipeline::RetentionStatus> retention() const override {
    return log_ ? log_->retention() : std::nullopt;
  }
  void close() override;
  const LogCounters& counters() const override { return *counters_; }

 private:
  static constexpr int kIdleSyncs = 10;

  DiskThread* const disk_;
  std::shared_ptr<LogCounters> counters_;
  std::shared_ptr<RowLog> log_;
  const Owner owner_;
  bool unsynced_ = false;
  int idle_ = kIdleSyncs;  // calls of sync() without a sync
};

/// Returns one log per axis, with counters of all; empty if no log is configured. Arguments as for LogWriter.
std::vector<std::unique_ptr<RowWriter>> make_logs(const pipeline::Setup& setup, DiskThread* disk, Problems& problems,
                                                  const LogWriter::Owner& owner, const SegmentPolicy& policy);

}  // namespace prism::log
