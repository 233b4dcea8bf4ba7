// SPDX-License-Identifier: MIT
// prismd's log as a recording: one file, or a folder of segments, with what its metadata says.
#include <algorithm>
#include <filesystem>
#include <sstream>

#include "compensation/compensated_text.hpp"
#include "compensation/sha256.hpp"
#include "config/text_file.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {
namespace {

namespace fs = std::filesystem;

Result<void> read_segment(const std::string& path, Recording& recording) {
  const auto text = config::read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  SourceFile file{path, sha256_hex(*text), 0};
  std::istringstream in(*text);
  CsvLines lines(in, path);
  if (!lines.next()) return refuse(path, "empty; expected a log of prismd");
  if (lines.line() != compensation::csv_columns()) return refuse(lines.place(), "not a log of prismd: other columns");
  recording.add_metadata(lines.comments());
  while (lines.next()) {
    const auto row = compensation::parse_csv(lines.line(), lines.place());
    if (!row) return tl::unexpected<Error>(row.error());
    recording.buckets.push_back(row->window.bucket);
    ++file.rows;
  }
  recording.files.push_back(std::move(file));
  return {};
}

std::vector<std::string> segments_of(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<std::string> paths;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".csv") paths.push_back(entry->path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

Result<Recording> read_log(const std::string& path) {
  Recording recording;
  const fs::path name(path);
  recording.name = (name.has_stem() ? name.stem() : name.parent_path().stem()).string();
  const auto paths = segments_of(path);
  if (paths.empty()) return refuse(path, "a folder without a .csv file");
  for (const std::string& segment : paths) {
    if (const auto done = read_segment(segment, recording); !done) return tl::unexpected<Error>(done.error());
  }
  return recording;
}

}  // namespace prism::recordings
