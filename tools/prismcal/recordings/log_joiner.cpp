// SPDX-License-Identifier: MIT
// Joins the rows of the segments of a log by session: each second of a session once.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"

namespace prism::recordings {
namespace {

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

/// Seconds that a session has, as ranges, in runs of increasing seconds.
class SeenSeconds {
 public:
  void begin_run() { runs_.emplace_back(); }
  void add(std::int64_t second) {
    std::vector<Range>& run = runs_.back();
    if (!run.empty() && run.back().last + 1 == second) {
      run.back().last = second;
    } else {
      run.push_back({second, second});
    }
  }
  bool contains(std::int64_t second) const {
    return std::any_of(runs_.begin(), runs_.end(), [&](const std::vector<Range>& run) {
      const auto found = std::lower_bound(run.begin(), run.end(), second,
                                          [](const Range& range, std::int64_t wanted) { return range.last < wanted; });
      return found != run.end() && found->first <= second;
    });
  }

 private:
  struct Range {
    std::int64_t first = 0, last = 0;
  };
  std::vector<std::vector<Range>> runs_;
};

/// Joins the rows of segments, added in order. Holds the last row back: the next one may show that it is partial.
class RowJoiner {
 public:
  RowJoiner(const LogFolder& folder, const OnLogRow& on_row) : on_row_(on_row) {
    for (const LogSegment& segment : folder.segments) {
      if (!segment.superseded) continue;
      std::uint64_t& from = superseded_from_[segment.superseded->file];
      from = from == 0 ? segment.superseded->row : std::min(from, segment.superseded->row);
    }
  }

  /// Returns false for a segment that is identical to another one: its rows are left out.
  bool begin(const LogSegment& segment) {
    const auto superseded = superseded_from_.find(segment.file);
    superseded_row_ = superseded == superseded_from_.end() ? UINT64_MAX : superseded->second;
    last_second_ = &last_seconds_[segment.session];
    other_session_ = !session_ || *session_ != segment.session;
    seen_ = &seen_seconds_[segment.session];
    // open() hashes those that may be identical.
    if (!segment.first_second || segment.sha256.empty() || checksums_.insert(segment.sha256).second) return true;
    ++left_out_.copies;
    left_out_.rows.push_back({segment.path, 0, "identical to another file"});
    return false;
  }

  Result<void> add(const LogSegment& segment, LogRow& row) {
    if (row.number >= superseded_row_) {
      ++left_out_.superseded;
      left_out_.rows.push_back({segment.path, row.line, kRepeatedLater});
      return {};
    }
    const std::int64_t second = row.second_mean.second;
    const bool new_session = other_session_;
    const bool continues = !new_session && held_ && second > held_->second_mean.second;
    if (!segment.session.empty()) {
      if (*last_second_ && second <= **last_second_) {
        ++left_out_.duplicates;
        left_out_.rows.push_back({segment.path, row.line,
                                  seen_->contains(second)
                                      ? "repeats a second of its session"
                                      : fmt::format("goes back by {} s in its session", **last_second_ - second)});
        return {};
      }
      *last_second_ = second;
    }
    if (new_session) session_ = segment.session;
    other_session_ = false;
    if (!continues) seen_->begin_run();
    seen_->add(second);
    const bool same_second = segment.session.empty() && !new_session && held_ && second == held_->second_mean.second;
    if (same_second) held_->second_mean.partial = row.second_mean.partial = true;
    if (auto done = release(); !done) return done;
    held_ = std::move(row);
    held_begins_ = !continues;
    return {};
  }

  void end(const LogSegment& segment, bool used) {
    if (!used) return;
    if (segment.end == SegmentEnd::kTruncated) {
      left_out_.truncated.push_back(segment.file);
      left_out_.truncated_bytes += segment.truncated_bytes;
    }
    if (segment.end == SegmentEnd::kChanged && segment.damaged.empty()) left_out_.changed.push_back(segment.file);
  }

  Result<LeftOut> finish() {
    if (auto done = release(); !done) return tl::unexpected<Error>(done.error());
    return std::move(left_out_);
  }

 private:
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
  std::optional<std::string> session_;  ///< of the last row that was used
  bool other_session_ = true;           ///< the segment's session is not session_
  std::map<std::string, std::optional<std::int64_t>> last_seconds_;
  std::optional<std::int64_t>* last_second_ = nullptr;  ///< of the session of the segment
  std::map<std::string, SeenSeconds> seen_seconds_;
  SeenSeconds* seen_ = nullptr;  ///< of the session of the segment
  std::map<std::string, std::uint64_t> superseded_from_;
  std::uint64_t superseded_row_ = UINT64_MAX;
  std::set<std::string> checksums_;
};

}  // namespace

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

Result<LeftOut> join_rows(LogFolder& folder, const OnLogRow& on_row, tables::ReadMeter& meter) {
  RowJoiner joiner(folder, on_row);
  const LogSegment* now = nullptr;
  bool used = false;
  SegmentVisitor visitor;
  visitor.begin = [&](const LogSegment& segment) {
    now = &segment;
    used = joiner.begin(segment);
  };
  visitor.row = [&](LogRow& row) { return used ? joiner.add(*now, row) : Result<void>(); };
  visitor.end = [&](const LogSegment& segment) -> Result<void> {
    if (segment.read_failed && !folder.salvaging)
      return make_error(fmt::format("{}:{}", segment.path, segment.damaged.back().line), segment.damaged.back().why);
    joiner.end(segment, used);
    return {};
  };
  if (auto done = read_log_rows(folder.segments, visitor, meter); !done) return tl::unexpected<Error>(done.error());
  auto left_out = joiner.finish();
  if (left_out) left_out->damaged = damage_lines(folder);
  return left_out;
}

}  // namespace prism::recordings
