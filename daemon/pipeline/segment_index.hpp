// SPDX-License-Identifier: MIT
// Index file with the order in which segments were made, which their names do not show (docs/formats.md).
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

namespace prism::pipeline {

/// A segment that retention deleted, or is about to delete.
struct SegmentDeletion {
  std::string file;
  std::uint64_t rows = 0;
  std::int64_t before_s = 0;  ///< start of the oldest segment that remains (data time, UTC); 0: not known
};

/// JSON lines in DIRECTORY/NAME.EXTENSION.index: a permanent id, and the number of each segment. Numbers increase and
/// are never reused. Lines that cannot be written are written at the next call, so that a full disk does not stop the
/// log. Does not throw on file system errors.
///
/// The age of a segment is the time that prismd measured, over all runs, since the last entry about its data: made or
/// ended. The clock of the index counts it; it never goes back and does not depend on the date.
class SegmentIndex {
 public:
  /// `path`: of the index. Does not read or create it yet.
  explicit SegmentIndex(std::string path) : path_(std::move(path)) {}

  /// Call before other members. Reads the index if it is a new or another file; creates one with a new id if it is
  /// missing or damaged. Numbers those `files`, in order, that have no number (older than the index, or made just
  /// before a power cut).
  void refresh(const std::vector<std::string>& files);

  /// False if the file is not there, or is not the one that refresh() read or made.
  bool in_place() const;

  /// Returns true once after refresh() replaced a damaged index: all numbers and ages begin again.
  bool take_damage() { return std::exchange(was_damaged_, false); }

  /// Reads the index without creating it. Returns false if it is missing or damaged.
  bool read();

  /// Returns 0 if the file has no number.
  std::uint64_t number(const std::string& file) const;
  void made(const std::string& file);
  void ended(const std::string& file, std::uint64_t rows);
  /// Like ended(), for a segment of an earlier run: its age stays.
  void found(const std::string& file, std::uint64_t rows);
  /// Call before the file is deleted, so that a power cut after that does not make it a missing file. Synced.
  void deleting(const SegmentDeletion& deletion);
  void deleted(const SegmentDeletion& deletion);
  /// Deletions that began and whose file is not in `present`: they were completed, but not recorded.
  std::vector<SegmentDeletion> interrupted(const std::vector<std::string>& present) const;
  /// Counts them as deleted, without writing. For readers.
  void settle(const std::vector<std::string>& present);

  /// prismd measured further `seconds`.
  void advance(std::int64_t seconds);
  /// Returns 0 if the file has no number.
  std::int64_t age_s(const std::string& file) const;
  /// Rows as passed to ended(), else 0.
  std::uint64_t rows(const std::string& file) const;
  /// Files that were made and not deleted, in order of creation.
  std::vector<std::string> files() const;

  const std::string& id() const { return id_; }
  /// Of all deletions since the log began.
  std::uint64_t deleted_segments() const { return deleted_segments_; }
  std::uint64_t deleted_rows() const { return deleted_rows_; }
  /// SegmentDeletion::before_s of the last deletion.
  std::int64_t deleted_before_s() const { return deleted_before_s_; }

 private:
  struct Entry {
    std::string file;
    std::uint64_t rows = 0;
    std::int64_t clock_s = 0;  ///< clock_s_ at its last entry
  };
  bool take_line(const std::string& line);
  void begin();
  void compact();
  void remember_file();
  bool take_head(const nlohmann::json& object);
  void take_clock(std::int64_t seconds);
  void take_number(std::uint64_t number, const std::string& file, std::uint64_t rows, std::int64_t clock_s);
  void forget(std::uint64_t number, std::uint64_t rows, std::int64_t before_s);
  void put(const nlohmann::ordered_json& line, bool sync = false);

  std::string path_;
  std::string id_, waiting_;
  std::map<std::uint64_t, Entry> entries_;
  std::map<std::string, std::uint64_t> numbers_;
  std::uint64_t next_ = 1, deleted_segments_ = 0, deleted_rows_ = 0, stale_lines_ = 0;
  std::map<std::uint64_t, SegmentDeletion> deleting_;  ///< by number
  std::int64_t clock_s_ = 0, written_clock_s_ = 0, deleted_before_s_ = 0;
  std::uint64_t device_ = 0, inode_ = 0;
  bool was_damaged_ = false;
};

}  // namespace prism::pipeline
