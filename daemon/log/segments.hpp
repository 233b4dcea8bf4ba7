// SPDX-License-Identifier: MIT
// Segment files of a log or capture: names, rotation, creation and retention.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/host_time.hpp"
#include "base/problems.hpp"
#include "base/result.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/interfaces.hpp"
#include "daemon/pipeline/stored_segments.hpp"

namespace prism::log {

using pipeline::NextDeletion;

/// A new segment: empty and open for appending. It is locked (flock) while open, so that other programs see that it is
/// being written. The receiver closes the descriptor.
struct NewSegment {
  int descriptor = -1;
  std::string path;
};

/// A file of the log or capture.
struct StoredSegment {
  pipeline::SegmentName name;
  std::uint64_t number = 0;  ///< name.number; of 0.3 and older: by its index, or by name
  std::string file, path;
  std::int64_t bytes = 0;
  std::optional<pipeline::LogPosition> position = {};  ///< of a log; nullopt: not read yet, or damaged
  bool is_damaged = false;                             ///< no position in the file
  std::uint64_t rows = 0;                              ///< of a log: as far as known; of 0.3 and older always
};

/// How segments are kept.
struct SegmentPolicy {
  pipeline::Tell tell = nullptr;  ///< gets events, on the thread that uses the segments; null: no events
  bool deletes = true;            ///< false: a replay, which deletes no segment, also if the disk is full
  std::int64_t notice_s = 60;     ///< a deletion is due for this time before it happens, so that `status` announces it
  std::function<std::int64_t()> uptime_s = prism::uptime_s;
};

/// True for an errno that means a full disk or an exceeded quota.
bool disk_is_full(int error);

/// The segments of one log or capture in one directory (pipeline::SegmentName). A log has a number for each row: a
/// segment holds those from its position on, up to the next segment's. Nothing else is stored: at the start, the files
/// in the directory are the log. Does not throw on file system errors: files that cannot be listed or deleted are kept.
class Segments {
 public:
  /// `extension`: with the dot.
  Segments(config::LogSegmentSettings settings, std::string name, std::string extension, SegmentPolicy policy = {});

  /// Returns true if data of `second`, with which the segment would have `bytes`, belong in a new segment (always at
  /// the first call). Uses data time only, so that a replay splits its segments as the live run did.
  bool begins_new(std::int64_t second, std::int64_t bytes);

  /// Creates the segment that begins at `second`, and its directory if needed. Never writes to an existing file or
  /// link. Errors: cannot create the directory or file.
  Result<NewSegment> make(std::int64_t second);

  /// The newest segment of a log: the header line of its position. `others`: its other header lines, which give a new
  /// log its id.
  std::string position_line(const std::string& others);
  /// The newest segment was closed; `rows` of its rows count.
  void ended(std::uint64_t rows);
  /// Deletes the newest segment, which has no row: its number is given again.
  void unmake();

  /// Call about once a second, never by a replay. Deletes the oldest segment if it exceeds keep_bytes or keep_days for
  /// notice_s; at most one per call, so that the caller's other work continues. The age is running time, not the date.
  /// Never deletes the newest segment, or one that another process writes. Each deletion is an event.
  void retain();
  /// As of the last retain(); nullopt before it. Thread-safe.
  std::optional<pipeline::RetentionStatus> retention() const;

  /// Deletes the oldest segment except the newest one, because the disk is full. Returns false if it deleted no file,
  /// also if the configuration forbids it (when_full).
  bool make_room();

  /// Finds what is stored, once; call it before the following members. Errors: the directory cannot be listed.
  Result<void> begin();
  /// In order of creation.
  const std::vector<StoredSegment>& stored() const { return stored_; }
  /// Of a log: number of the first row of stored()[i]; 0: damaged.
  std::uint64_t first(std::size_t i);
  /// Of a log: rows in the file of stored()[i].
  std::uint64_t written(std::size_t i);
  /// Number of the newest segment that was made.
  std::uint64_t newest() const { return next_ - 1; }
  /// Id of the log; zeros: it has no row yet.
  const std::string& id() const { return id_; }
  /// Rows of the log before the open segment, with deleted ones.
  std::uint64_t end() const { return end_; }
  /// Rows before the oldest segment.
  std::uint64_t deleted_rows();

  /// Reports an event about these segments.
  void report(pipeline::Severity severity, const char* kind, const std::string& text) const {
    if (policy_.tell) policy_.tell(severity, kind, text);
  }

  /// Returns false if the newest segment, open as `descriptor`, was deleted or moved.
  bool in_place(int descriptor) const;

 private:
  std::string index_path() const { return settings_.directory + "/" + name_ + extension_ + ".index"; }
  bool is_log() const { return extension_ == ".csv"; }
  Result<void> scan();
  void begin_log(const pipeline::OldIndex& index);
  void begin_capture(const pipeline::OldIndex& index);
  void number_old(const pipeline::OldIndex& index);
  const pipeline::LogPosition* position(std::size_t i);
  std::int64_t running_s() const;
  std::int64_t started_s(std::size_t i);
  std::int64_t age_s(std::size_t i);
  std::uint64_t rows_of(std::size_t i);
  bool remove(std::size_t i, NextDeletion::Why why);
  std::string reason(NextDeletion::Why why) const;
  std::optional<NextDeletion> plan(pipeline::RetentionStatus& status);
  bool delete_due(NextDeletion& next);
  const char* section() const { return is_log() ? "log" : "capture"; }

  config::LogSegmentSettings settings_;
  std::string name_, extension_, current_;
  SegmentPolicy policy_;
  std::vector<StoredSegment> stored_;
  std::string id_ = pipeline::kNoLog;
  std::uint64_t next_ = 1, end_ = 0;
  bool has_begun_ = false;
  std::int64_t started_s_, ran_s_ = 0;  // uptime at the start; running time of earlier runs
  std::int64_t period_ = INT64_MIN;
  std::int64_t next_look_s_ = INT64_MIN;                    // uptime
  std::optional<std::int64_t> due_since_s_, first_look_s_;  // uptime
  std::int64_t first_bytes_ = 0, removed_bytes_ = 0;        // at the first look; deleted since then
  std::string kept_;                                        // the file that cannot be deleted, as reported
  mutable std::mutex status_mutex_;
  std::optional<pipeline::RetentionStatus> status_;
};

/// A problem of a file that is written: counts what is dropped until it is over. Thread-safe.
class WriteFault {
 public:
  /// `what` is written, counted in `unit` ("log", "rows"); `dropped` is never reset. `problems` must outlive this.
  WriteFault(std::string what, const std::string& name, std::string unit, std::atomic<std::uint64_t>& dropped,
             Problems& problems)
      : what_(std::move(what)),
        key_(what_ + " " + name),
        unit_(std::move(unit)),
        dropped_(dropped),
        problems_(problems) {}

  void begin(const std::string& why) { lose(0, why); }

  /// `count` units were lost because of `why`.
  void lose(std::uint64_t count, const std::string& why) {
    dropped_ += count;
    problems_.set(key_,
                  {.kind = "disk",
                   .level = Problem::Level::kFailed,
                   .text = fmt::format("{}: {}; {} are dropped and counted until it works again", what_, why, unit_),
                   .unit = unit_,
                   .count = count});
  }

  /// `count` more because of the fault that is known.
  void drop(std::uint64_t count) {
    dropped_ += count;
    problems_.add(key_, count);
  }

  /// Data were synced. The fault ends at the second call without one in between, so that a disk that fails every other
  /// row is one fault.
  void synced() {
    const Problem known = problems_.find(key_);
    if (known.since_s != 0)
      problems_.clear(key_, fmt::format("{}: writing again after {} {} were dropped", what_, known.count, unit_), 2);
  }

 private:
  const std::string what_, key_, unit_;
  std::atomic<std::uint64_t>& dropped_;
  Problems& problems_;
};

/// Exponential backoff of write attempts, in turns of about a second.
class ExponentialBackoff {
 public:
  static constexpr int kLongest = 60;

  /// Call once per turn. Returns true if an attempt is due.
  bool over() { return turns_ == 0 || --turns_ == 0; }
  void begin() { turns_ = pause_ = std::clamp(2 * pause_, 1, kLongest); }
  void end() { turns_ = pause_ = 0; }

 private:
  int pause_ = 0, turns_ = 0;
};

}  // namespace prism::log
