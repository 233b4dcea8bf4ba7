// SPDX-License-Identifier: MIT
// The order in which segments were made, kept beside them: names alone do not tell it (docs/formats.md).
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace prism::pipeline {

/// JSON lines in FOLDER/NAME.EXTENSION.index: an id, made once, and the number of each segment. Numbers only go up and
/// never come again. What cannot be written waits for the next call: a full disk costs the log nothing but this file's
/// last lines. No error of the file system throws.
class SegmentIndex {
 public:
  /// `path` of the index; nothing is read or made yet.
  explicit SegmentIndex(std::string path) : path_(std::move(path)) {}

  /// Call before the index is asked: reads it where it is another file than the one known (or none is), makes a new one
  /// with a new id where there is none or it is damaged, and gives numbers to `files` that have none (written before
  /// there was an index, or just before a power cut), in the order given.
  void refresh(const std::vector<std::string>& files);

  /// What stands there, and nothing is made. False: no index, or one of damage.
  bool read();

  /// 0: none.
  std::uint64_t number(const std::string& file) const;
  void made(const std::string& file);
  void ended(const std::string& file, std::uint64_t rows);
  void deleted(const std::string& file, std::uint64_t rows);
  /// Rows that ended() said; 0: it did not.
  std::uint64_t rows(const std::string& file) const;
  /// Those that were made and not deleted, in this order.
  std::vector<std::string> files() const;

  const std::string& id() const { return id_; }
  /// Of all segments that were deleted.
  std::uint64_t deleted_rows() const { return deleted_rows_; }

 private:
  struct Entry {
    std::string file;
    std::uint64_t rows = 0;
  };
  bool in_place() const;
  bool take_line(const std::string& line);
  void begin();
  void compact();
  void remember_file();
  void take_number(std::uint64_t number, const std::string& file, std::uint64_t rows);
  void forget(std::uint64_t number, std::uint64_t rows);
  void put(const nlohmann::ordered_json& line);

  std::string path_;
  std::string id_, waiting_;
  std::map<std::uint64_t, Entry> entries_;
  std::map<std::string, std::uint64_t> numbers_;
  std::uint64_t next_ = 1, deleted_segments_ = 0, deleted_rows_ = 0, stale_lines_ = 0;
  std::uint64_t device_ = 0, inode_ = 0;
};

}  // namespace prism::pipeline
