// SPDX-License-Identifier: MIT
// Index file with the order in which segments were made, which their names do not show (docs/formats.md).
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace prism::pipeline {

/// JSON lines in DIRECTORY/NAME.EXTENSION.index: a permanent id, and the number of each segment. Numbers increase and
/// are never reused. Lines that cannot be written are written at the next call, so that a full disk does not stop the
/// log. Does not throw on file system errors.
class SegmentIndex {
 public:
  /// `path`: of the index. Does not read or create it yet.
  explicit SegmentIndex(std::string path) : path_(std::move(path)) {}

  /// Call before other members. Reads the index if it is a new or another file; creates one with a new id if it is
  /// missing or damaged. Numbers those `files`, in order, that have no number (older than the index, or made just
  /// before a power cut).
  void refresh(const std::vector<std::string>& files);

  /// Reads the index without creating it. Returns false if it is missing or damaged.
  bool read();

  /// Returns 0 if the file has no number.
  std::uint64_t number(const std::string& file) const;
  void made(const std::string& file);
  void ended(const std::string& file, std::uint64_t rows);
  void deleted(const std::string& file, std::uint64_t rows);
  /// Rows as passed to ended(), else 0.
  std::uint64_t rows(const std::string& file) const;
  /// Files that were made and not deleted, in order of creation.
  std::vector<std::string> files() const;

  const std::string& id() const { return id_; }
  /// Rows of all deleted segments.
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
