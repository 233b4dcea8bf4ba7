// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/index_check.hpp"

namespace prism::verification {
namespace {

using recordings::LogSegment;
using recordings::SegmentEnd;

Finding of_segment(const LogSegment& segment) {
  const std::string rows = fmt::format("{}, format {}", counted(segment.rows.size(), "row"), segment.format);
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

LogSession session_of(const std::string& log, const recordings::LogTable& joined, std::size_t begin, std::size_t end) {
  LogSession session;
  session.log = log;
  session.first_s = joined.rows[begin].second_mean.second + 1;
  session.last_s = joined.rows[end - 1].second_mean.second + 1;
  session.rows = end - begin;
  for (std::size_t row = begin; row < end; ++row) {
    const compensation::SecondMean& second_mean = joined.rows[row].second_mean;
    session.partial += second_mean.partial;
    session.missing_frames += second_mean.missing_frames;
    const std::int64_t before = row > begin ? joined.rows[row - 1].second_mean.second : second_mean.second - 1;
    if (second_mean.second == before + 1) continue;
    session.gaps.push_back({before + 2, second_mean.second});
    session.missing_s += static_cast<std::uint64_t>(second_mean.second - before - 1);
  }
  return session;
}

}  // namespace

void check_log(const FolderContents& contents, VerificationResult& result) {
  if (contents.log.empty()) return;
  const auto folder = recordings::LogFolder::salvage(contents.log);
  std::map<std::string, std::uint64_t> rows;
  for (const LogSegment& segment : folder.segments) {
    rows[segment.file] = segment.rows.size() + segment.damaged.size();
    result.findings.push_back(of_segment(segment));
    for (const auto& row : segment.damaged)
      result.findings.push_back({row.path, FileState::kDamaged, row.why, row.line});
  }
  for (const auto& rejected : folder.rejected) {
    std::error_code error;
    if (!std::filesystem::exists(rejected.path, error) && !contents.one_file)
      continue;  // deleted meanwhile by the retention limit
    result.findings.push_back({rejected.path, FileState::kUnreadable, without_path(rejected.error, rejected.path)});
  }
  if (!contents.one_file) Indexes(contents.folder, ".csv").check(rows, result.findings);
  if (auto one = folder.of_one_gyro(contents.log); !one)
    result.findings.push_back({contents.log, FileState::kUnreadable, one.error().what});
  const std::vector<recordings::LogFolder> axes = folder.by_axis();
  for (const recordings::LogFolder& axis : axes) {
    const recordings::LogTable joined = recordings::join_rows(axis);
    add_left_out(joined.left_out.rows, result.findings);
    for (std::size_t i = 0; i < joined.sessions.size(); ++i) {
      const std::size_t end = i + 1 < joined.sessions.size() ? joined.sessions[i + 1] : joined.rows.size();
      result.sessions.push_back(session_of(contents.log, joined, joined.sessions[i], end));
      if (axes.size() > 1) result.sessions.back().axis = axis.segments.front().value("axis");
    }
  }
}

}  // namespace prism::verification
