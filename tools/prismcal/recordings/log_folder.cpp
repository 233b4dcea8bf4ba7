// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/log_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "daemon/pipeline/segment_index.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {
namespace {

namespace fs = std::filesystem;

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

bool lists_any(const std::string& index_file, const std::vector<LogSegment>& segments) {
  pipeline::SegmentIndex index(index_file);
  return index.read() && std::any_of(segments.begin(), segments.end(),
                                     [&](const LogSegment& segment) { return index.number(segment.file) > 0; });
}

// One line per file that cannot be read, and per file with damaged rows: the first of them.
std::vector<std::string> damage_lines(const LogFolder& folder) {
  std::vector<std::string> lines;
  for (const LogFolder::RejectedFile& file : folder.rejected) lines.push_back(file.error.text() + "; file not used");
  for (const LogSegment& segment : folder.segments) {
    if (segment.damaged.empty()) continue;
    const LeftOutRow& row = segment.damaged.front();
    lines.push_back(
        fmt::format("{}:{}: {}; {} not used", row.path, row.line, row.why, counted(segment.damaged.size(), "row")));
  }
  return lines;
}

/// Joins the rows of segments, added in order.
class RowJoiner {
 public:
  explicit RowJoiner(const LogFolder& folder) {
    for (const LogSegment& segment : folder.segments) {
      if (segment.supersedes_row == 0) continue;
      std::uint64_t& from = superseded_from_[segment.supersedes_file];
      from = from == 0 ? segment.supersedes_row : std::min(from, segment.supersedes_row);
    }
  }

  void add(const LogSegment& segment) {
    LeftOut& left_out = joined_.left_out;
    if (!segment.rows.empty() && !checksums_.insert(segment.sha256).second) {
      ++left_out.copies;
      left_out.rows.push_back({segment.path, 0, "identical to another file"});
      return;
    }
    if (segment.end == SegmentEnd::kTruncated) {
      left_out.truncated.push_back(segment.file);
      left_out.truncated_bytes += segment.truncated_bytes;
    }
    if (segment.end == SegmentEnd::kChanged && segment.damaged.empty()) left_out.changed.push_back(segment.file);
    const auto superseded = superseded_from_.find(segment.file);
    for (const LogRow& row : segment.rows) {
      if (superseded == superseded_from_.end() || row.number < superseded->second) {
        add(segment, row);
        continue;
      }
      ++left_out.superseded;
      left_out.rows.push_back({segment.path, row.line, kRepeatedLater});
    }
  }

  LogTable result() && {
    for (const LogRow& row : joined_.rows) {
      joined_.left_out.partial += row.second_mean.partial;
      joined_.left_out.clocks_differ += !row.second_mean.partial && row.second_mean.clocks_differ;
      joined_.left_out.implausible += !row.second_mean.partial && row.second_mean.implausible.any();
    }
    return std::move(joined_);
  }

 private:
  void add(const LogSegment& segment, const LogRow& row) {
    std::vector<LogRow>& rows = joined_.rows;
    const std::int64_t second = row.second_mean.second;
    const bool new_session = !session_ || *session_ != segment.session;
    const bool continues = !new_session && !rows.empty() && second > rows.back().second_mean.second;
    if (!segment.session.empty()) {
      const auto [last, is_first] = last_second_.try_emplace(segment.session, second);
      if (!is_first && second <= last->second) {
        ++joined_.left_out.duplicates;
        joined_.left_out.rows.push_back({segment.path, row.line,
                                         appeared_before(segment.session, second)
                                             ? "repeats a second of its session"
                                             : fmt::format("goes back by {} s in its session", last->second - second)});
        return;
      }
      last->second = second;
    }
    session_ = segment.session;
    if (!continues) {
      joined_.sessions.push_back(rows.size());
      runs_[segment.session].push_back(rows.size());
    }
    const bool same_second =
        segment.session.empty() && !new_session && !rows.empty() && second == rows.back().second_mean.second;
    if (same_second) rows.back().second_mean.partial = true;
    rows.push_back(row);
    if (same_second) rows.back().second_mean.partial = true;
  }

  // Seconds increase within each run of `runs_`.
  bool appeared_before(const std::string& session, std::int64_t second) const {
    const auto& rows = joined_.rows;
    const auto& begins = joined_.sessions;
    const auto before = [](const LogRow& row, std::int64_t wanted) { return row.second_mean.second < wanted; };
    const auto& runs = runs_.at(session);
    return std::any_of(runs.begin(), runs.end(), [&](std::size_t begin) {
      const auto next = std::upper_bound(begins.begin(), begins.end(), begin);
      const auto end = next == begins.end() ? rows.end() : rows.begin() + static_cast<std::ptrdiff_t>(*next);
      const auto found = std::lower_bound(rows.begin() + static_cast<std::ptrdiff_t>(begin), end, second, before);
      return found != end && found->second_mean.second == second;
    });
  }

  LogTable joined_;
  std::map<std::string, std::vector<std::size_t>> runs_;  // first row of each run of increasing seconds, by session
  std::optional<std::string> session_;
  std::map<std::string, std::int64_t> last_second_;
  std::map<std::string, std::uint64_t> superseded_from_;
  std::set<std::string> checksums_;
};

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

std::string deletion_text(const std::string& index_file) {
  pipeline::SegmentIndex index(index_file);
  if (!index.read()) return {};
  std::vector<std::string> present;
  for (const std::string& path : files_of(fs::path(index_file).parent_path().string(), ""))
    present.push_back(fs::path(path).filename().string());
  index.settle(present);
  if (index.deleted_segments() == 0) return {};
  const std::string before = index.deleted_before_s() == 0 ? "" : ", before " + utc_text(index.deleted_before_s());
  return fmt::format("retention deleted {}, {}{}", counted(index.deleted_segments(), "segment"),
                     counted(index.deleted_rows(), "row"), before);
}

Result<LogFolder> LogFolder::read(const std::string& path, const std::string& axis, const std::string& column) {
  LogFolder folder = salvage(path, column);
  if (folder.segments.empty() && !folder.rejected.empty()) return tl::unexpected<Error>(folder.rejected.front().error);
  if (folder.segments.empty()) return make_error(path, no_log_text(path));
  if (auto one = folder.choose(axis, path); !one) return tl::unexpected<Error>(one.error());
  for (const LogSegment& segment : folder.segments) {
    if (!segment.read_failed) continue;
    const LeftOutRow& last = segment.damaged.back();
    return make_error(fmt::format("{}:{}", last.path, last.line), last.why);
  }
  if (auto one = folder.of_one_gyro(path); !one) return tl::unexpected<Error>(one.error());
  for (const std::string& file : folder.indexes) {
    const std::string text = lists_any(file, folder.segments) ? deletion_text(file) : "";
    if (!text.empty()) folder.deletions.push_back(text);
  }
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
    for (const std::string& file : indexes) {
      if (lists_any(file, part.segments)) part.indexes.push_back(file);
    }
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

LogFolder LogFolder::salvage(const std::string& path, const std::string& column) {
  LogFolder folder;
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  for (const std::string& file : is_folder ? files_of(path, ".csv") : std::vector{path}) {
    auto segment = read_log_segment(file, column);
    if (segment) {
      folder.segments.push_back(std::move(*segment));
    } else {
      folder.rejected.push_back({file, std::move(segment.error())});
    }
  }
  std::map<std::string, std::uint64_t> numbers;
  for (const std::string& file : is_folder ? files_of(path, ".csv.index") : std::vector<std::string>()) {
    pipeline::SegmentIndex index(file);
    if (!index.read()) continue;
    folder.indexes.push_back(file);
    for (const LogSegment& segment : folder.segments) {
      if (const std::uint64_t number = index.number(segment.file); number > 0) numbers[segment.file] = number;
    }
  }
  std::map<std::string, std::uint64_t> numbers_by_checksum;  // so that a copy sorts directly after its original
  for (const LogSegment& segment : folder.segments) {
    if (const auto number = numbers.find(segment.file); number != numbers.end())
      numbers_by_checksum[segment.sha256] = number->second;
  }
  const auto sort_key = [&](const LogSegment& segment) {
    const auto number = numbers_by_checksum.find(segment.sha256);
    return std::tuple(number == numbers_by_checksum.end() ? 0 : number->second, !numbers.contains(segment.file),
                      segment.format, segment.session,
                      segment.rows.empty() ? INT64_MIN : segment.rows.front().second_mean.second, by_name(segment));
  };
  std::sort(folder.segments.begin(), folder.segments.end(),
            [&](const LogSegment& a, const LogSegment& b) { return sort_key(a) < sort_key(b); });
  return folder;
}

LogTable join_rows(const LogFolder& folder) {
  RowJoiner joiner(folder);
  for (const LogSegment& segment : folder.segments) joiner.add(segment);
  LogTable joined = std::move(joiner).result();
  joined.left_out.damaged = damage_lines(folder);
  return joined;
}

std::vector<std::string> LeftOut::lines() const {
  std::vector<std::string> lines;
  if (partial > 0) lines.push_back(counted(partial, "second") + " not used: partial, at the start or end of a session");
  if (implausible > 0) lines.push_back(counted(implausible, "second") + " not used: implausible values");
  if (clocks_differ > 0)
    lines.push_back(counted(clocks_differ, "second") +
                    " not used: frames arrived at another rate than described (clocks_differ)");
  if (duplicates > 0)
    lines.push_back(counted(duplicates, "row") + " left out: the second repeats or goes back in its session");
  if (copies > 0) lines.push_back(counted(copies, "file") + " left out: identical to another one");
  if (superseded > 0)
    lines.push_back(counted(superseded, "row") + " left out: repeated in a later segment after a disk error");
  if (!truncated.empty())
    lines.push_back(
        fmt::format("{} without an end (copied while open, or prismd was killed): {}{}; {} of incomplete rows left out",
                    counted(truncated.size(), "segment"), truncated.front(), truncated.size() > 1 ? ", …" : "",
                    counted(truncated_bytes, "byte")));
  lines.insert(lines.end(), damaged.begin(), damaged.end());
  for (const std::string& file : changed)
    lines.push_back(fmt::format("{} was changed after it was written: it does not match its end line", file));
  return lines;
}

}  // namespace prism::recordings
