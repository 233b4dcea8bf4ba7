// SPDX-License-Identifier: MIT
#include "tools/prismcal/log_folder.hpp"

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
#include "tools/prismcal/recording.hpp"

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

std::uint64_t size_of(const LogSegment& segment) {
  std::error_code error;
  const auto size = fs::file_size(segment.path, error);
  return error ? 0 : size;
}

/// Sets the checksums of segments that may be identical to another one: of equal size, with equal first lines.
void hash_alike(std::vector<LogSegment>& segments) {
  using Begin = std::tuple<std::uint64_t, std::string, std::optional<std::int64_t>>;
  std::map<Begin, std::vector<LogSegment*>> alike;
  for (LogSegment& segment : segments)
    alike[{size_of(segment), segment.comments, segment.first_second}].push_back(&segment);
  for (const auto& [begin, several] : alike) {
    for (LogSegment* segment : several)
      if (several.size() > 1) segment->sha256 = sha256_of_file(segment->path).value_or("");
  }
}

/// Opens all segments and sorts them: by the number of their position, or of the index next to them.
LogFolder opened(const std::string& path, const std::string& column) {
  LogFolder folder;
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  for (const std::string& file : is_folder ? files_of(path, ".csv") : std::vector{path}) {
    auto segment = open_log_segment(file, column);
    if (segment)
      folder.segments.push_back(std::move(*segment));
    else
      folder.rejected.push_back({file, std::move(segment.error())});
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
    // "NAME-20261121T091100Z-10.csv" after "…Z-2.csv".
    return std::tuple(number, own == numbers.end(), segment.format, segment.session,
                      segment.first_second.value_or(INT64_MIN), segment.file.size(), segment.file);
  };
  std::sort(folder.segments.begin(), folder.segments.end(),
            [&](const LogSegment& a, const LogSegment& b) { return sort_key(a) < sort_key(b); });
  return folder;
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

/// Joins the rows of segments, read in order. Holds the last row back: the next one may show that it is partial.
class RowJoiner {
 public:
  RowJoiner(const LogFolder& folder, const OnLogRow& on_row) : on_row_(on_row) {
    for (const LogSegment& segment : folder.segments) {
      if (!segment.superseded) continue;
      std::uint64_t& from = superseded_from_[segment.superseded->file];
      from = from == 0 ? segment.superseded->row : std::min(from, segment.superseded->row);
    }
  }

  /// Rows of a segment that is identical to another one are left out.
  Result<void> read(LogSegment& segment) {
    // opened() hashes those that may be identical.
    const bool is_copy = segment.first_second && !segment.sha256.empty() && !checksums_.insert(segment.sha256).second;
    if (is_copy) leave_out(segment, 0, "identical to another file", left_out_.copies);
    const auto superseded = superseded_from_.find(segment.file);
    superseded_row_ = superseded == superseded_from_.end() ? UINT64_MAX : superseded->second;
    last_second_ = &last_seconds_[segment.session];
    const auto add_row = [&](LogRow& row) { return is_copy ? Result<void>() : add(segment, row); };
    if (auto done = read_log_segment(segment, add_row); !done || is_copy) return done;
    if (segment.end == SegmentEnd::kTruncated) {
      left_out_.truncated.push_back(segment.file);
      left_out_.truncated_bytes += segment.truncated_bytes;
    }
    if (segment.end == SegmentEnd::kChanged && segment.damaged.empty()) left_out_.changed.push_back(segment.file);
    return {};
  }

  Result<LeftOut> finish() {
    if (auto done = release(); !done) return tl::unexpected<Error>(done.error());
    return std::move(left_out_);
  }

 private:
  void leave_out(const LogSegment& segment, std::size_t line, const char* why, std::uint64_t& count) {
    ++count;
    left_out_.rows.push_back({segment.path, line, why});
  }

  Result<void> add(const LogSegment& segment, LogRow& row) {
    const std::int64_t second = row.second_mean.second;
    const bool has_session = !segment.session.empty();
    if (row.number >= superseded_row_)
      return leave_out(segment, row.line, kRepeatedLater, left_out_.superseded), Result<void>();
    if (has_session && *last_second_ && second <= **last_second_)
      return leave_out(segment, row.line, kNotLater, left_out_.duplicates), Result<void>();
    *last_second_ = second;
    const bool same_session = session_ == segment.session;
    const bool continues = same_session && second > held_->second_mean.second;
    if (!has_session && same_session && second == held_->second_mean.second)
      held_->second_mean.partial = row.second_mean.partial = true;
    if (auto done = release(); !done) return done;
    if (!same_session) session_ = segment.session;
    if (!held_) held_.emplace();
    std::swap(*held_, row);
    held_begins_ = !continues;
    return {};
  }

  Result<void> release() {
    if (!held_) return {};
    const compensation::SecondMean& second_mean = held_->second_mean;
    left_out_.partial += second_mean.partial;
    left_out_.clocks_differ += !second_mean.partial && second_mean.clocks_differ;
    left_out_.implausible += !second_mean.partial && second_mean.implausible.any();
    return on_row_(*held_, held_begins_);
  }

  const OnLogRow& on_row_;
  LeftOut left_out_;
  std::optional<LogRow> held_;
  bool held_begins_ = false;
  std::optional<std::string> session_;  ///< of held_
  std::map<std::string, std::optional<std::int64_t>> last_seconds_;
  std::optional<std::int64_t>* last_second_ = nullptr;  ///< of the session of the segment
  std::map<std::string, std::uint64_t> superseded_from_;
  std::uint64_t superseded_row_ = UINT64_MAX;
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

std::string Absent::text() const {
  if (segments == 0) return {};
  const std::string what = rows > 0 ? counted(rows, "row") : counted(segments, "segment");
  const std::string before = before_s == 0 ? "" : ", before " + utc_text(before_s);
  return fmt::format("begins with segment {}: {} of the log are not here{}", segments + 1, what, before);
}

namespace {

// Of each log, as its oldest segment says.
std::vector<std::string> absent_texts(const std::vector<LogSegment>& segments) {
  std::map<std::string, Absent> logs;
  for (const LogSegment& segment : segments) {
    if (!segment.position) continue;
    const pipeline::LogPosition& position = *segment.position;
    const Absent absent{position.segment - 1, position.first - 1, segment.first_second.value_or(-1) + 1};
    const auto log = logs.try_emplace(position.log, absent).first;
    if (absent.segments < log->second.segments) log->second = absent;
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
  if (fs::is_directory(path, error)) folder.absent = absent_texts(folder.segments);
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
  for (const LogSegment& segment : segments) sum += size_of(segment);
  return sum;
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

Result<LeftOut> join_rows(LogFolder& folder, const OnLogRow& on_row) {
  RowJoiner joiner(folder, on_row);
  for (LogSegment& segment : folder.segments) {
    if (auto done = joiner.read(segment); !done) return tl::unexpected<Error>(done.error());
    if (segment.read_failed && !folder.salvaging)
      return make_error(fmt::format("{}:{}", segment.path, segment.damaged.back().line), segment.damaged.back().why);
  }
  auto left_out = joiner.finish();
  if (left_out) left_out->damaged = damage_lines(folder);
  return left_out;
}

std::vector<std::string> axes_of_log(const std::string& path) { return LogFolder::salvage(path).axes(); }

Result<Recording> read_log(const std::string& path, const SourceOptions& options, LeaveOut leave_out,
                           const SecondConsumer& consumer) {
  auto folder = LogFolder::open(path, options.axis);
  if (!folder) return tl::unexpected<Error>(folder.error());
  Recording recording;
  const fs::path name(path);
  recording.name = (name.has_stem() ? name.stem() : name.parent_path().stem()).string();
  for (const LogSegment& segment : folder->segments) recording.add_metadata(segment.comments);
  SecondFeed feed(recording, leave_out, true, consumer);
  const auto left_out = join_rows(
      *folder, [&](const LogRow& row, bool begins_session) { return feed.push(row.second_mean, begins_session); });
  if (!left_out) return tl::unexpected<Error>(left_out.error());
  add_remarks(recording.findings, "file", left_out->lines());
  if (auto done = feed.finish(); !done) return tl::unexpected<Error>(done.error());
  for (const LogSegment& segment : folder->segments)
    recording.files.push_back({segment.path, segment.sha256, segment.rows});
  add_remarks(recording.findings, "absent", folder->absent);
  return recording;
}

}  // namespace prism::recordings
