// SPDX-License-Identifier: MIT
// Files in segments: their names, when the next one begins, how it is made, and which old ones go.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/segment_index.hpp"

namespace prism::log {

/// A segment that was just made: empty, open for appending, locked (flock) as long as it is open: others see by that
/// whether somebody still writes it. Who gets it closes the descriptor.
struct NewSegment {
  int descriptor = -1;
  std::string path;
};

/// A segment by its place in the index.
struct NumberedSegment {
  std::uint64_t number = 0;
  std::string file, path;  ///< path: empty where the file is gone without having been deleted here
  std::uint64_t rows = 0;  ///< 0: nobody ended it
};

/// Who has a say when segments are deleted.
class SegmentGuard {
 public:
  virtual ~SegmentGuard() = default;
  /// True where it is to stay as long as the disk has room. `rows` in it.
  virtual bool holds(std::uint64_t segment, std::uint64_t rows) = 0;
  /// It is gone.
  virtual void deleted(std::uint64_t segment, std::uint64_t rows) = 0;
};

/// Of errno: there is no room, for this user or for all.
bool disk_is_full(int error);

/// The segments of one log or one capture: NAME-20261121T091100Z.EXTENSION in one folder, named after the second (UTC,
/// of data time) that they begin with; "-2", "-3", … stand before the extension where that name is taken. Their order
/// is that in which they were made, which an index beside them keeps: after a clock was set back, names tell another
/// one. No error of the file system throws: what cannot be listed or deleted stays.
class Segments {
 public:
  /// `extension` with its dot.
  Segments(config::SegmentSettings settings, std::string name, std::string extension);

  /// `guard` outlives this.
  void ask(SegmentGuard& guard) { guard_ = &guard; }

  /// True where data of `second` that bring the segment to `bytes` belong into a new one. The first call begins one.
  /// By data time only, so that a replay cuts its segments where the live run did.
  bool begins_new(std::int64_t second, std::int64_t bytes);

  /// Makes the segment that begins at `second`, and its folder where there is none; then deletes the oldest segments
  /// beyond keep_bytes and keep_days. A file or link that is there is never written to. Refused where folder or file
  /// cannot be made.
  Result<NewSegment> make(std::int64_t second);

  /// The segment last made was closed, whole, with so many rows or packets in it.
  void ended(std::uint64_t rows);

  /// The disk is full: deletes the oldest segment but the one last made. False where there is none, or where the
  /// configuration says to stop (when_full).
  bool make_room();

  /// All that were made and not deleted, in order. The folder's index is read, and made where there is none.
  std::vector<NumberedSegment> numbered();
  /// How many good rows a segment has that nobody ended.
  void found(const std::string& file, std::uint64_t rows) { index_.ended(file, rows); }
  /// Of the index, as numbered() last found it; empty: none could be made.
  const std::string& id() const { return index_.id(); }
  std::uint64_t deleted_rows() const { return index_.deleted_rows(); }

  /// False where the segment last made, open as `descriptor`, was deleted or moved away.
  bool in_place(int descriptor) const;

 private:
  struct Segment {
    std::string path, file, stamp;
    std::int64_t bytes;
  };
  std::vector<Segment> list() const;
  /// Paths by file name; each file has a number afterwards.
  std::map<std::string, std::string> number_all();
  bool remove(const Segment& segment);
  std::uint64_t rows_in(const Segment& segment) const;
  bool is_held(const Segment& segment) const;
  void delete_old(std::int64_t second);

  config::SegmentSettings settings_;
  std::string name_, extension_, current_;
  pipeline::SegmentIndex index_;
  SegmentGuard* guard_ = nullptr;
  std::int64_t period_ = INT64_MIN;
};

}  // namespace prism::log
