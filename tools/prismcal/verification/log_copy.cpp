// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "config/version.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/copies.hpp"

namespace prism::verification {
namespace {

using recordings::LogSegment;
using recordings::SegmentEnd;

// "gyro1.csv.index" for "gyro1-20261121T091100Z-2.csv".
std::string index_name(const std::string& file) {
  constexpr std::string_view kStamp = "-00000000T000000Z";
  std::string stem = std::filesystem::path(file).stem().string();
  const std::size_t at = stem.rfind('Z') + 1 - kStamp.size();  // past the end if there is no 'Z'
  const auto fits = [](char found, char wanted) {
    return wanted == '0' ? found >= '0' && found <= '9' : found == wanted;
  };
  if (at < stem.size() && std::equal(kStamp.begin(), kStamp.end(), stem.begin() + std::ptrdiff_t(at), fits))
    stem.resize(at);
  return stem + ".csv.index";
}

// Text for "# repaired:" in the copy of a segment.
std::string remark_of(const LogSegment& segment, std::size_t left_out) {
  static const std::map<SegmentEnd, const char*> kEndTexts{
      {SegmentEnd::kIntact, "intact"},
      {SegmentEnd::kOpen, "open"},
      {SegmentEnd::kTruncated, "truncated"},
      {SegmentEnd::kChanged, "changed: it did not match its end line"}};
  return fmt::format("by prismcal {}; the segment was {}; {} left out", kVersion, kEndTexts.at(segment.end),
                     counted(left_out, "row"));
}

/// The lines of all readable rows, except `without`.
std::vector<std::size_t> kept_lines(const LogSegment& segment, const std::set<std::size_t>& without) {
  std::vector<std::size_t> kept;
  kept.reserve(segment.rows);
  LogSegment again = segment;
  tables::ReadMeter meter;
  recordings::SegmentVisitor visitor;
  visitor.row = [&](const recordings::LogRow& row) {
    if (!without.contains(row.line)) kept.push_back(row.line);
    return Result<void>();
  };
  (void)recordings::read_log_rows(std::span(&again, 1), visitor, meter);  // the errors are those of the visitor
  return kept;
}

// Returns the number of rows in the copy; 0: not copied.
Result<std::size_t> copy_segment(const LogSegment& segment, const std::set<std::size_t>& without,
                                 const Copies& copies) {
  if (without.contains(0)) return 0;  // identical to another file
  for (const auto& row : segment.damaged) copies.leave_out(row.path, row.line, row.why);
  if (segment.truncated_bytes > 0)
    copies.leave_out(segment.path, segment.truncated_line,
                     counted(segment.truncated_bytes, "byte") + " of an incomplete row");
  const auto kept = kept_lines(segment, without);
  if (segment.rows == 0) copies.leave_out(segment.path, 0, "found no complete row");
  if (kept.empty()) return 0;
  const std::size_t left_out = segment.rows + segment.damaged.size() - kept.size();
  if (segment.end == SegmentEnd::kIntact && left_out == 0) {
    return copy_bytes(segment.path, copies).map([&] { return kept.size(); });
  }
  const auto text = recordings::rewritten(segment, kept, remark_of(segment, left_out));
  if (!text) return tl::unexpected<Error>(text.error());
  return write_text_file(copies.target(segment.path), *text).map([&] { return kept.size(); });
}

Result<void> copy_axis(recordings::LogFolder& folder, const Copies& copies) {
  std::map<std::string, std::set<std::size_t>> without;
  tables::ReadMeter meter;
  const auto ignore = [](const recordings::LogRow&, bool) { return Result<void>(); };
  const auto left_out = recordings::join_rows(folder, ignore, meter);
  if (!left_out) return tl::unexpected<Error>(left_out.error());
  for (const auto& row : left_out->rows) {
    copies.leave_out(row.path, row.line, row.why);
    without[row.path].insert(row.line);
  }
  std::vector<std::pair<std::string, std::uint64_t>> made;
  for (const LogSegment& segment : folder.segments) {
    const auto rows = copy_segment(segment, without[segment.path], copies);
    if (!rows) return tl::unexpected<Error>(rows.error());
    copies.repaired.rows += *rows;
    if (*rows > 0) made.emplace_back(segment.file, *rows);
  }
  copies.repaired.segments += made.size();
  if (made.empty()) return {};
  const std::string name = folder.indexes.empty() ? index_name(made.front().first)
                                                  : std::filesystem::path(folder.indexes.front()).filename().string();
  return write_index(name, made, copies);
}

}  // namespace

Result<void> copy_log(const FolderContents& contents, const Copies& copies) {
  if (contents.log.empty()) return {};
  const auto folder = recordings::LogFolder::salvage(contents.log);
  if (auto one = folder.of_one_gyro(contents.log); !one) return one;
  for (const auto& rejected : folder.rejected)
    copies.leave_out(rejected.path, 0, without_path(rejected.error, rejected.path));
  for (recordings::LogFolder& axis : folder.by_axis()) {
    if (auto done = copy_axis(axis, copies); !done) return done;
  }
  return {};
}

}  // namespace prism::verification
