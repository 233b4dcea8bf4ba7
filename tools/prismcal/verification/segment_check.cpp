// SPDX-License-Identifier: MIT
#include "tools/prismcal/verification/segment_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"

namespace prism::verification {

namespace fs = std::filesystem;

void check_numbers(const std::string& folder, bool has_older, std::vector<NumberedSegment> segments,
                   std::vector<Finding>& findings) {
  const auto key = [](const NumberedSegment& one) {
    return std::tie(one.position.log, one.position.segment, one.path);
  };
  std::sort(segments.begin(), segments.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  const NumberedSegment* last = nullptr;
  for (const NumberedSegment& next : segments) {
    if (last == nullptr || last->position.log != next.position.log) {
      const recordings::Absent absent{next.position.segment - 1, next.position.first - 1, next.begin_s};
      if (absent.segments > 0 && !has_older) findings.push_back({folder, FileState::kDeleted, absent.text()});
    } else if (next.position.segment > last->position.segment) {  // else a copy
      const std::uint64_t files = next.position.segment - last->position.segment - 1;
      const std::uint64_t end = last->position.first + last->rows;
      const std::uint64_t rows = std::max(next.position.first, end) - end;
      if (files > 0)
        findings.push_back({last->path, FileState::kMissing,
                            fmt::format("the next {}{}", counted(files, "segment"),
                                        rows > 0 ? ", with " + counted(rows, "row") : "")});
      else if (rows > 0)
        findings.push_back(
            {last->path, FileState::kMissing, fmt::format("{} of {}", rows, counted(last->rows + rows, "row"))});
    }
    last = &next;
  }
}

void check_old_indexes(const std::string& folder, const std::string& extension,
                       const std::map<std::string, std::uint64_t>& rows, std::vector<Finding>& findings) {
  for (const std::string& file : recordings::files_of(folder, extension + ".index")) {
    const auto index = pipeline::OldIndex::read(file);
    if (!index) {
      findings.push_back({file, FileState::kDamaged, "not a valid index; segments are ordered by session and name"});
      continue;
    }
    const recordings::Absent absent = recordings::absent_of(*index, folder);
    if (absent.segments > 0) findings.push_back({file, FileState::kDeleted, absent.text()});
    bool has_begun = false;
    for (const auto& [number, entry] : index->entries) {
      const std::string path = (fs::path(folder) / entry.file).string();
      const auto found = rows.find(entry.file);
      std::error_code error;
      const bool is_there = fs::exists(path, error);
      has_begun = has_begun || is_there;
      if (!is_there && has_begun) {
        findings.push_back({path, FileState::kMissing,
                            "listed in the index" + (entry.rows > 0 ? ", with " + counted(entry.rows, "row") : "")});
      } else if (found != rows.end() && found->second < entry.rows) {
        findings.push_back(
            {path, FileState::kMissing,
             fmt::format("{} of {} listed in the index", entry.rows - found->second, counted(entry.rows, "row"))});
      }
    }
  }
}

}  // namespace prism::verification
