// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/segment_check.hpp"

namespace prism::verification {
namespace {

using recordings::LogSegment;
using recordings::SegmentEnd;

Finding of_segment(const LogSegment& segment) {
  const std::string rows = fmt::format("{}, format {}", counted(segment.rows, "row"), segment.format);
  switch (segment.end) {
    case SegmentEnd::kIntact:
      return {segment.path, segment.damaged.empty() ? FileState::kIntact : FileState::kDamaged, rows};
    case SegmentEnd::kOpen:
      return {segment.path, FileState::kOpen, rows + "; prismd writes it"};
    case SegmentEnd::kTruncated:
      return {segment.path, FileState::kTruncated,
              segment.truncated_bytes == 0
                  ? rows + ", no end"
                  : fmt::format("{}, no end; {} of an incomplete row from line {} on", rows,
                                counted(segment.truncated_bytes, "byte"), segment.truncated_line)};
    case SegmentEnd::kChanged:
      break;
  }
  return {segment.path, FileState::kChanged, rows + "; differs from its end line, or has bytes after it"};
}

// Adds one finding for consecutive rows that are left out for the same reason.
void add_left_out(const std::vector<recordings::LeftOutRow>& rows, std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t end = i + 1;
    while (end < rows.size() && rows[end].path == rows[i].path && rows[end].why == rows[i].why) ++end;
    const bool superseded = rows[i].why == recordings::kRepeatedLater;
    const std::string range = fmt::format("{} rows, to line {}: ", end - i, rows[end - 1].line);
    findings.push_back({rows[i].path, superseded ? FileState::kSuperseded : FileState::kDuplicate,
                        (end - i > 1 ? range : "") + rows[i].why, rows[i].line});
    i = end;
  }
}

/// Meanwhile, by the retention limit.
bool is_deleted(const std::string& path) {
  std::error_code error;
  return !std::filesystem::exists(path, error);
}

/// Counts the rows of each session.
class SessionCounter {
 public:
  SessionCounter(std::string log, std::vector<LogSession>& sessions) : log_(std::move(log)), sessions_(sessions) {}

  void add(const compensation::SecondMean& second_mean, bool begins_session) {
    if (begins_session) {
      sessions_.emplace_back().log = log_;
      sessions_.back().first_s = second_mean.second + 1;
      last_ = second_mean.second - 1;
    }
    LogSession& session = sessions_.back();
    session.last_s = second_mean.second + 1;
    ++session.rows;
    session.partial += second_mean.partial;
    session.missing_frames += second_mean.missing_frames;
    if (second_mean.second != last_ + 1) {
      session.gaps.push_back({last_ + 2, second_mean.second});
      session.missing_s += static_cast<std::uint64_t>(second_mean.second - last_ - 1);
    }
    last_ = second_mean.second;
  }

 private:
  std::string log_;
  std::vector<LogSession>& sessions_;
  std::int64_t last_ = 0;
};

/// Reads the rows of one axis. Returns what is left out.
recordings::LeftOut read_axis(recordings::LogFolder& folder, const std::string& log, const std::string& axis,
                              VerificationResult& result, tables::ReadMeter& meter) {
  const std::size_t before = result.sessions.size();
  SessionCounter counter(log, result.sessions);
  auto left_out = recordings::join_rows(
      folder,
      [&](const recordings::LogRow& row, bool begins_session) {
        counter.add(row.second_mean, begins_session);
        return Result<void>();
      },
      meter);
  for (std::size_t i = before; i < result.sessions.size(); ++i) result.sessions[i].axis = axis;
  return left_out ? std::move(*left_out) : recordings::LeftOut();  // never an error: a failed disk is damage here
}

}  // namespace

void check_log(const FolderContents& contents, const tables::ReadProgress& progress, VerificationResult& result) {
  if (contents.log.empty()) return;
  const auto folder = recordings::LogFolder::salvage(contents.log);
  tables::ReadMeter meter(progress, folder.bytes());
  std::vector<recordings::LogFolder> axes = folder.by_axis();
  std::vector<Finding> left_out;
  std::map<std::string, const LogSegment*> read;
  for (recordings::LogFolder& axis : axes) {
    const std::string name = axes.size() > 1 ? axis.segments.front().value("axis") : "";
    add_left_out(read_axis(axis, contents.log, name, result, meter).rows, left_out);
    for (const LogSegment& segment : axis.segments) read[segment.path] = &segment;
  }
  std::map<std::string, std::uint64_t> rows;
  std::vector<NumberedSegment> numbered;
  for (const LogSegment& opened : folder.segments) {
    const LogSegment& segment = *read.at(opened.path);
    if (segment.read_failed && is_deleted(segment.path) && !contents.one_file) continue;
    rows[segment.file] = segment.rows + segment.damaged.size();
    if (segment.position)
      numbered.push_back({segment.path, *segment.position, rows[segment.file], segment.first_second.value_or(-1) + 1});
    result.findings.push_back(of_segment(segment));
    for (const auto& row : segment.damaged)
      result.findings.push_back({row.path, FileState::kDamaged, row.why, row.line});
  }
  for (const auto& rejected : folder.rejected) {
    if (is_deleted(rejected.path) && !contents.one_file) continue;
    result.findings.push_back({rejected.path, FileState::kUnreadable, without_path(rejected.error, rejected.path)});
  }
  if (!contents.one_file) {
    check_old_indexes(contents.folder, ".csv", rows, result.findings);
    const bool has_older = numbered.size() < rows.size();
    check_numbers(contents.folder, has_older, std::move(numbered), result.findings);
  }
  if (auto one = folder.of_one_gyro(contents.log); !one)
    result.findings.push_back({contents.log, FileState::kUnreadable, one.error().what});
  result.findings.insert(result.findings.end(), left_out.begin(), left_out.end());
}

}  // namespace prism::verification
