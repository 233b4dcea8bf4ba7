// SPDX-License-Identifier: MIT
// Segment files of a log or capture: names, rotation, creation and retention.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/host_time.hpp"
#include "base/result.hpp"
#include "config/config.hpp"
#include "daemon/log/retention.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/retention_status.hpp"
#include "daemon/pipeline/segment_index.hpp"

namespace prism::log {

/// A new segment: empty and open for appending. It is locked (flock) while open, so that other programs see that it is
/// being written. The receiver closes the descriptor.
struct NewSegment {
  int descriptor = -1;
  std::string path;
};

/// A segment of the index.
struct NumberedSegment {
  std::uint64_t number = 0;
  std::string file, path;  ///< path: empty if the file was removed by another program
  std::uint64_t rows = 0;  ///< 0: not known (no end line)
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

/// The segments of one log or capture: NAME-20261121T091100Z.EXTENSION in one directory, named after their first second
/// (UTC, data time). If the name exists, "-2", "-3", … is added before the extension. An index file stores the order of
/// creation; the order of the names differs after a clock was set back. Does not throw on file system errors: files
/// that cannot be listed or deleted are kept.
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

  /// The newest segment was closed, complete, with `rows` rows.
  void ended(std::uint64_t rows);

  /// Call about once a second, never by a replay. Deletes the oldest segment if it exceeds keep_bytes or keep_days for
  /// notice_s; at most one per call, so that the caller's other work continues. The age is the index's, not the date.
  /// Never deletes the newest segment, or one that another process writes. Each deletion is an event.
  void retain();
  /// As of the last retain(); nullopt before it. Thread-safe.
  std::optional<pipeline::RetentionStatus> retention() const;

  /// Deletes the oldest segment except the newest one, because the disk is full. Returns false if it deleted no file,
  /// also if the configuration forbids it (when_full).
  bool make_room();

  /// Returns all segments that were made and not deleted, in order. Reads the index, or creates it if missing.
  std::vector<NumberedSegment> numbered();
  /// Stores the number of complete rows of a segment without an end line.
  void found(const std::string& file, std::uint64_t rows) { index_.found(file, rows); }
  /// Id of the index at the last numbered(); empty: it could not be created.
  const std::string& id() const { return index_.id(); }
  std::uint64_t deleted_rows() const { return index_.deleted_rows(); }

  /// Reports an event about these segments.
  void report(pipeline::Severity severity, const char* kind, const std::string& text) const {
    if (policy_.tell) policy_.tell(severity, kind, text);
  }

  /// Returns false if the newest segment, open as `descriptor`, was deleted or moved.
  bool in_place(int descriptor) const;

 private:
  struct Segment {
    std::string path, file, stamp;
    std::int64_t bytes;
  };
  std::vector<Segment> list() const;
  /// Numbers all files and records deletions that a power cut interrupted; returns the paths by file name.
  std::map<std::string, std::string> number_all();
  void measure();
  bool remove(const Segment& segment, pipeline::NextDeletion::Why why);
  void record_deletion(const pipeline::SegmentDeletion& deletion, const std::string& text);
  std::uint64_t rows_in(const Segment& segment);
  std::optional<pipeline::NextDeletion> plan(const std::vector<Segment>& segments, pipeline::RetentionStatus& status);
  bool delete_due(const std::vector<Segment>& segments, pipeline::NextDeletion& next);
  const char* section() const { return extension_ == ".csv" ? "log" : "capture"; }

  config::LogSegmentSettings settings_;
  std::string name_, extension_, current_;
  SegmentPolicy policy_;
  pipeline::SegmentIndex index_;
  std::int64_t period_ = INT64_MIN;
  bool is_listed_ = false;                                  ///< all files of the folder have numbers
  std::optional<std::int64_t> measured_s_;                  // uptime when the index's clock was advanced last
  std::int64_t next_look_s_ = INT64_MIN;                    // uptime
  std::optional<std::int64_t> due_since_s_, first_look_s_;  // uptime
  std::int64_t first_bytes_ = 0, removed_bytes_ = 0;        // at the first look; deleted since then
  std::string kept_;                                        // the file that cannot be deleted, as reported
  std::map<std::string, std::uint64_t> counted_;            // rows of segments without an end line, by file
  mutable std::mutex status_mutex_;
  std::optional<pipeline::RetentionStatus> status_;
};

}  // namespace prism::log
