// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/log_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "tools/prismcal/recordings/bytes_kind.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {
namespace {

namespace fs = std::filesystem;
using pipeline::OldIndex;

// Error text for a folder without a log: the number of files, and a capture or the first file.
std::string no_log_text(const fs::path& folder) {
  const std::vector<std::string> names = files_of(folder.string(), "");
  if (names.empty()) return "found an empty folder, expected one with prismd's log, *.csv";
  const auto capture = std::find_if(names.begin(), names.end(), is_capture);
  const fs::path example = capture != names.end() ? *capture : names.front();
  return fmt::format("found a folder with {} but no .csv ({}), expected prismd's log{}", counted(names.size(), "file"),
                     example.filename().string(),
                     capture != names.end() ? "; give the capture itself, with --config" : "");
}

// Version 0.1 wrote "-" if there was no axis.
std::string axis_of(const LogSegment& segment) {
  std::string axis = segment.value("axis");
  return axis == "-" ? "" : axis;
}

// Sorts "NAME-20261121T091100Z-10.csv" after "…Z-2.csv".
auto by_name(const LogSegment& segment) { return std::tuple(segment.file.size(), segment.file); }

/// Sets the checksums of segments that may be identical to another one: of equal size, with equal first bytes.
void hash_alike(std::vector<LogSegment>& segments) {
  std::map<std::pair<std::uint64_t, std::string>, std::vector<LogSegment*>> alike;
  for (LogSegment& segment : segments) {
    std::string first(1u << 15, '\0');
    auto in = FileReader::open(segment.path);
    first.resize(in ? in->read(first) : 0);
    std::error_code error;
    const auto size = fs::file_size(segment.path, error);
    alike[{error ? 0 : size, sha256_hex(first)}].push_back(&segment);
  }
  for (const auto& [key, several] : alike) {
    for (LogSegment* segment : several) {
      if (several.size() > 1) segment->sha256 = sha256_of_file(segment->path).value_or("");
    }
  }
}

/// Opens all segments and sorts them.
LogFolder opened(const std::string& path, const std::string& column) {
  LogFolder folder;
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  for (const std::string& file : is_folder ? files_of(path, ".csv") : std::vector{path}) {
    auto segment = open_log_segment(file, column);
    if (segment) {
      folder.segments.push_back(std::move(*segment));
    } else {
      folder.rejected.push_back({file, std::move(segment.error())});
    }
  }
  hash_alike(folder.segments);
  std::map<std::string, std::uint64_t> numbers;
  for (const LogSegment& segment : folder.segments) {  // a copy of another name has the number of its original
    if (segment.position && segment.file.find(fmt::format("-{:06}-", segment.position->segment)) != std::string::npos)
      numbers[segment.file] = segment.position->segment;
  }
  for (const std::string& file : is_folder ? files_of(path, ".csv.index") : std::vector<std::string>()) {
    for (const auto& [number, entry] : OldIndex::read(file).value_or(OldIndex()).entries)
      numbers.try_emplace(entry.file, number);
  }
  std::map<std::string, std::uint64_t> numbers_by_checksum;  // so that a copy sorts directly after its original
  for (const LogSegment& segment : folder.segments) {
    if (const auto number = numbers.find(segment.file); number != numbers.end() && !segment.sha256.empty())
      numbers_by_checksum[segment.sha256] = number->second;
  }
  const auto sort_key = [&](const LogSegment& segment) {
    const auto own = numbers.find(segment.file);
    const auto alike = numbers_by_checksum.find(segment.sha256);
    const std::uint64_t number = alike != numbers_by_checksum.end() ? alike->second
                                 : own != numbers.end()             ? own->second
                                 : segment.position                 ? segment.position->segment
                                                                    : 0;
    return std::tuple(number, own == numbers.end(), segment.format, segment.session,
                      segment.first_second.value_or(INT64_MIN), by_name(segment));
  };
  std::sort(folder.segments.begin(), folder.segments.end(),
            [&](const LogSegment& a, const LogSegment& b) { return sort_key(a) < sort_key(b); });
  return folder;
}

}  // namespace

std::vector<std::string> files_of(const std::string& folder, const std::string& extension) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().string().ends_with(extension)) paths.push_back(entry->path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string Absent::text() const {
  if (segments == 0) return {};
  const std::string what = rows > 0 ? counted(rows, "row") : counted(segments, "segment");
  const std::string before = before_s == 0 ? "" : ", before " + utc_text(before_s);
  return fmt::format("begins with segment {}: {} of the log are not here{}", segments + 1, what, before);
}

Absent absent_of(const OldIndex& index, const std::string& folder) {
  Absent absent{index.deleted_segments, index.deleted_rows, index.deleted_before_s};
  for (const auto& [number, entry] : index.entries) {
    std::error_code error;
    if (fs::exists(fs::path(folder) / entry.file, error)) break;
    ++absent.segments;
    absent.rows += entry.rows;
  }
  return absent;
}

namespace {

// Of each log, as its oldest segment says; of 0.3 and older as the index says.
std::vector<std::string> absent_texts(const std::string& folder, const std::vector<LogSegment>& segments) {
  std::map<std::string, Absent> logs;
  for (const LogSegment& segment : segments) {
    if (!segment.position) continue;
    const pipeline::LogPosition& position = *segment.position;
    const Absent absent{position.segment - 1, position.first - 1, segment.first_second.value_or(-1) + 1};
    const auto log = logs.try_emplace(position.log, absent).first;
    if (absent.segments < log->second.segments) log->second = absent;
  }
  for (const std::string& file : files_of(folder, ".csv.index")) {
    const OldIndex index = OldIndex::read(file).value_or(OldIndex());
    if (std::any_of(segments.begin(), segments.end(), [&](const auto& one) { return index.number(one.file) > 0; }))
      logs[index.id] = absent_of(index, folder);
  }
  std::vector<std::string> texts;
  for (const auto& [log, absent] : logs)
    if (absent.segments > 0) texts.push_back(absent.text());
  return texts;
}

}  // namespace

Result<LogFolder> LogFolder::open(const std::string& path, const std::string& axis, const std::string& column) {
  LogFolder folder = opened(path, column);
  if (folder.segments.empty() && !folder.rejected.empty()) return tl::unexpected<Error>(folder.rejected.front().error);
  if (folder.segments.empty()) return make_error(path, no_log_text(path));
  if (auto one = folder.choose(axis, path); !one) return tl::unexpected<Error>(one.error());
  if (auto one = folder.of_one_gyro(path); !one) return tl::unexpected<Error>(one.error());
  std::error_code error;
  if (fs::is_directory(path, error)) folder.absent = absent_texts(path, folder.segments);
  return folder;
}

Result<void> LogFolder::of_one_gyro(const std::string& path) const {
  for (const char* key : {"instance", "gyro_serial"}) {
    const LogSegment* first = nullptr;
    for (const LogSegment& segment : segments) {
      const std::string value = segment.value(key);
      if (value.empty() || value == "unknown") continue;
      if (first != nullptr && first->value(key) != value) {
        return make_error(path,
                          fmt::format("found logs of {} \"{}\" ({}) and \"{}\" ({}), expected one", key,
                                      plain_text(first->value(key)), first->file, plain_text(value), segment.file));
      }
      first = first != nullptr ? first : &segment;
    }
  }
  return {};
}

std::vector<std::string> LogFolder::axes() const {
  std::set<std::string> names;
  for (const LogSegment& segment : segments) names.insert(axis_of(segment));
  names.erase("");
  return {names.begin(), names.end()};
}

std::vector<LogFolder> LogFolder::by_axis() const {
  const std::vector<std::string> names = axes();
  std::map<std::string, LogFolder> parts;
  for (const LogSegment& segment : segments) {
    const std::string axis = axis_of(segment);
    parts[axis.empty() && names.size() == 1 ? names.front() : axis].segments.push_back(segment);
  }
  std::vector<LogFolder> folders;
  for (auto& [name, part] : parts) {
    part.salvaging = salvaging;
    folders.push_back(std::move(part));
  }
  return folders;
}

Result<void> LogFolder::choose(const std::string& axis, const std::string& path) {
  const std::vector<std::string> names = axes();
  if (axis.empty() && names.size() < 2) return {};
  if (axis.empty())
    return make_error(
        path, fmt::format("found logs of the axes {}, expected one; choose it with --axis", fmt::join(names, ", ")));
  std::erase_if(segments, [&](const LogSegment& segment) { return axis_of(segment) != axis; });
  if (segments.empty())
    return make_error(
        path, fmt::format("found no log of axis \"{}\", expected one of {}", plain_text(axis),
                          names.empty() ? "a log that names its axis" : fmt::format("{}", fmt::join(names, ", "))));
  return {};
}

LogFolder LogFolder::salvage(const std::string& path) {
  LogFolder folder = opened(path, "");
  folder.salvaging = true;
  return folder;
}

std::uint64_t LogFolder::bytes() const {
  std::uint64_t sum = 0;
  for (const LogSegment& segment : segments) {
    std::error_code error;
    const auto size = fs::file_size(segment.path, error);
    sum += error ? 0 : size;
  }
  return sum;
}

}  // namespace prism::recordings
