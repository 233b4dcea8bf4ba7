// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "compensation/compensated_text.hpp"
#include "compensation/sha256.hpp"

namespace prism::recordings {
namespace {

namespace fs = std::filesystem;

void read_metadata(std::string_view line, Recording& recording) {
  const std::size_t colon = line.find(": ");
  if (line.size() < 2 || colon == std::string_view::npos) return;
  recording.metadata.emplace(line.substr(2, colon - 2), line.substr(colon + 2));
}

Result<void> read_segment(const std::string& path, Recording& recording) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return refuse(path, "cannot be opened");
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  SourceFile file{path, sha256_hex(text), 0};
  bool columns_seen = false;
  std::size_t number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line(text.data() + begin, end - begin);
    begin = end + 1;
    ++number;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty()) continue;
    if (line[0] == '#') {
      read_metadata(line, recording);
    } else if (!columns_seen) {
      if (line != compensation::csv_columns())
        return refuse(fmt::format("{}:{}", path, number), "not a log of prismd: other columns");
      columns_seen = true;
    } else {
      const auto row = compensation::parse_csv(line, fmt::format("{}:{}", path, number));
      if (!row) return tl::unexpected(row.error());
      recording.buckets.push_back(row->window.bucket);
      ++file.rows;
    }
  }
  if (!columns_seen) return refuse(path, "empty; expected a log of prismd");
  recording.files.push_back(std::move(file));
  return {};
}

std::vector<std::string> segments_of(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(path, error)) {
    if (entry.path().extension() == ".csv") paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

std::string Recording::value(const std::string& key) const {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

Result<Recording> read_recording(const std::string& path) {
  Recording recording;
  fs::path name(path);
  recording.name = (name.has_stem() ? name.stem() : name.parent_path().stem()).string();
  const auto paths = segments_of(path);
  if (paths.empty()) return refuse(path, "a folder without a .csv file");
  for (const std::string& segment : paths) {
    if (const auto done = read_segment(segment, recording); !done) return tl::unexpected(done.error());
  }
  return recording;
}

Result<compensation::AxisPlacement> site_of(const Recording& recording) {
  compensation::AxisPlacement placement;
  const std::string site = recording.value("site");
  if (std::sscanf(site.c_str(), "latitude_deg %lf elevation_deg %lf azimuth_deg %lf", &placement.latitude_deg,
                  &placement.elevation_deg, &placement.azimuth_deg) != 3) {
    return refuse(recording.name, "its log states no site; say --latitude and --elevation, or --no-earth-rate");
  }
  return placement;
}

}  // namespace prism::recordings
