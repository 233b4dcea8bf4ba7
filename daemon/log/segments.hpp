// SPDX-License-Identifier: MIT
// Segment files of a log or capture: names, rotation, creation and retention.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/notice.hpp"
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

/// Can delay the deletion of segments.
class SegmentGuard {
 public:
  virtual ~SegmentGuard() = default;
  /// Returns true if the segment must be kept unless the disk is full. `rows`: its number of rows.
  virtual bool holds(std::uint64_t segment, std::uint64_t rows) = 0;
  /// Called after the segment was deleted.
  virtual void deleted(std::uint64_t segment, std::uint64_t rows) = 0;
};

/// How segments are kept.
struct SegmentPolicy {
  pipeline::Tell tell = nullptr;  ///< gets events, on the thread that uses the segments; null: no events
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

  /// `guard` must outlive this.
  void ask(SegmentGuard& guard) { guard_ = &guard; }

  /// Returns true if data of `second`, with which the segment would have `bytes`, belong in a new segment (always at
  /// the first call). Uses data time only, so that a replay splits its segments as the live run did.
  bool begins_new(std::int64_t second, std::int64_t bytes);

  /// Creates the segment that begins at `second`, and its directory if needed; then deletes the oldest segments above
  /// keep_bytes or keep_days. Never writes to an existing file or link. Errors: cannot create the directory or file.
  Result<NewSegment> make(std::int64_t second);

  /// The newest segment was closed, complete, with `rows` rows.
  void ended(std::uint64_t rows);

  /// Deletes the oldest segment except the newest one, because the disk is full. Returns false if it deleted no file,
  /// also if the configuration forbids it (when_full).
  bool make_room();

  /// Returns all segments that were made and not deleted, in order. Reads the index, or creates it if missing.
  std::vector<NumberedSegment> numbered();
  /// Stores the number of complete rows of a segment without an end line.
  void found(const std::string& file, std::uint64_t rows) { index_.ended(file, rows); }
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
  /// Numbers all files; returns their paths by file name.
  std::map<std::string, std::string> number_all();
  bool remove(const Segment& segment);
  std::uint64_t rows_in(const Segment& segment) const;
  bool is_held(const Segment& segment) const;
  void delete_old(std::int64_t second);

  config::LogSegmentSettings settings_;
  std::string name_, extension_, current_;
  SegmentPolicy policy_;
  pipeline::SegmentIndex index_;
  SegmentGuard* guard_ = nullptr;
  std::int64_t period_ = INT64_MIN;
};

}  // namespace prism::log
