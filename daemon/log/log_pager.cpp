// SPDX-License-Identifier: MIT
#include "daemon/log/log_pager.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::log {
namespace {

using nlohmann::json;

constexpr std::size_t kRemembered = 64;  // cached places

// Rows written by prism need no escape; a segment that a user edited may.
std::string text_json(const std::string& line) {
  const bool plain = std::all_of(line.begin(), line.end(),
                                 [](unsigned char c) { return c >= 0x20 && c < 0x7f && c != '"' && c != '\\'; });
  return plain ? '"' + line + '"' : json_text(json(line));
}

tl::unexpected<RowRefusal> refused(config::SocketError code, std::string text) {
  return tl::unexpected(RowRefusal{code, std::move(text), {}, 0});
}

// Members of a JSON object. "log" is in the page; "sensor_line" occurs several times.
std::string metadata_json(std::string_view lines) {
  std::string members;
  for (std::size_t end; (end = lines.find('\n')) != std::string_view::npos; lines.remove_prefix(end + 1)) {
    const std::string_view line = lines.substr(2, end - 2);
    const std::size_t colon = line.find(": ");
    const std::string_view key = line.substr(0, colon);
    if (colon == std::string_view::npos || key == "log" || key == "sensor_line") continue;
    members += (members.empty() ? "" : ",") + json_text(json(key)) + ":" + json_text(json(line.substr(colon + 2)));
  }
  return members;
}

}  // namespace

// A page ends before a gap, so that `missing` is always a gap before its first row.
RowResult LogPager::page(const RowQuery& query, std::uint64_t synced) {
  if (auto begun = segments_.begin(); !begun) return refused(config::kFailed, "rows: " + begun.error().text());
  const std::uint64_t end = segments_.end() + synced, deleted = segments_.deleted_rows();
  const auto begin = resolve(query.after, end);
  if (!begin) return tl::unexpected(begin.error());
  if (begin->total < deleted)
    return tl::unexpected(
        RowRefusal{config::kRowsGone,
                   fmt::format("rows/after: rows {} to {} of the log were deleted before they were read; continue with "
                               "\"after\" of this error's data",
                               begin->total + 1, deleted),
                   {segments_.id(), 0, 0, deleted},
                   deleted - begin->total});
  RowPage page;
  page.after = *begin;
  page.json = fmt::format("{{\"log\":\"{}\",\"segments\":[", segments_.id());
  const std::size_t head_bytes = page.json.size();
  for (const Part& part : parts(begin->total, end)) {
    const std::uint64_t behind = std::max(begin->total, part.before) - part.before;
    const std::uint64_t gap = part.before + behind - page.after.total;
    const bool full = page.rows >= query.limit || page.json.size() - head_bytes >= kMostBytes;
    if (full || (page.rows > 0 && gap > 0)) break;
    const std::uint64_t most = std::min<std::uint64_t>(query.limit - page.rows, part.end - part.before - behind);
    const auto found = rows_of(part, behind, most, query.header);
    if (!found && page.rows > 0) break;
    if (!found) return tl::unexpected(found.error());
    page.missing += gap;
    page.json += (page.rows > 0 && found->rows > 0 ? "," : "") + found->json;
    page.rows += found->rows;
    page.after = {segments_.id(), part.segment->number, behind + found->rows, part.before + behind + found->rows};
    if (found->rows == most) continue;
    if (found->in_file) report_loss(part, *found);
    if (!found->in_file || page.rows > 0) break;
    page.missing += part.end - page.after.total;
    page.after = {segments_.id(), part.segment->number, part.end - part.before, part.end};
  }
  page.json += fmt::format("],\"after\":\"{}\",\"more\":{},\"missing\":{},\"behind\":{},\"kept\":{},\"deleted\":{}",
                           page.after.text(), page.after.total < end, page.missing, end - page.after.total,
                           end - deleted, deleted);
  page.json.shrink_to_fit();  // it may wait long for its client
  while (places_.size() > kRemembered) places_.erase(places_.begin());
  return page;
}

// The segments with rows behind `after`, oldest first. A segment without a position has what lies between its
// neighbours.
std::vector<LogPager::Part> LogPager::parts(std::uint64_t after, std::uint64_t end) {
  const std::vector<StoredSegment>& stored = segments_.stored();
  std::vector<Part> parts;
  std::uint64_t above = segments_.newest() + 1;  // number of the segment above
  for (std::size_t i = stored.size(); i-- > 0 && end > after; above = stored[i].number) {
    const std::uint64_t first = segments_.first(i);
    Part part{&stored[i], first > 0, first > 0 ? first - 1 : after, end};
    for (std::size_t below = i; first == 0 && below-- > 0;) {
      if (segments_.first(below) == 0) continue;
      part.before = std::max(after, segments_.first(below) - 1 + segments_.written(below));
      break;
    }
    // Files between this one and the next were removed.
    if (first > 0 && above != stored[i].number + 1) part.end = std::min(end, part.before + segments_.written(i));
    if (part.before < part.end && part.end > after) parts.push_back(part);
    end = std::min(end, part.before);
  }
  std::reverse(parts.begin(), parts.end());
  return parts;
}

tl::expected<RowCursor, RowRefusal> LogPager::resolve(const std::string& after, std::uint64_t end) {
  const std::string& id = segments_.id();
  const std::vector<StoredSegment>& stored = segments_.stored();
  if (after.empty() || after == "earliest") return RowCursor{id, 0, 0, segments_.deleted_rows()};
  if (after == "latest") {
    const std::uint64_t first = stored.empty() ? 0 : segments_.first(stored.size() - 1);
    return RowCursor{id, segments_.newest(), first > 0 ? end + 1 - first : 0, end};
  }
  auto cursor = RowCursor::parse(after);
  if (!cursor)
    return refused(
        config::kInvalidParams,
        fmt::format("rows: found cursor \"{:.80}\", expected one that rows returned, \"earliest\" or \"latest\"",
                    after));
  if (cursor->total == 0 && cursor->log == pipeline::kNoLog) return RowCursor{id, 0, 0, 0};
  if (cursor->log != id) {
    return refused(config::kUnknownCursor,
                   fmt::format("rows/after: found a cursor of log {:.8}, expected one of log {:.8}: the directory was "
                               "emptied or replaced; use \"earliest\" to read it from the start",
                               cursor->log, id));
  }
  bool is_good = cursor->segment <= segments_.newest() && cursor->total <= end;
  for (std::size_t i = 0; i < stored.size(); ++i) {
    const bool is_own = stored[i].number == cursor->segment;
    if (!is_own && stored[i].number != cursor->segment + 1) continue;
    const std::uint64_t first = segments_.first(i);
    is_good &= first == 0 || (is_own ? first - 1 + cursor->row == cursor->total : cursor->total < first);
  }
  if (!is_good)
    return refused(config::kUnknownCursor,
                   fmt::format("rows/after: found a cursor after row {} of segment {}, which the "
                               "log does not have; use \"earliest\" to read it from the start",
                               cursor->row, cursor->segment));
  return *cursor;
}

std::optional<LogPager::Head> LogPager::head_of(const StoredSegment& segment) {
  auto in = FileReader::open(segment.path);
  Head head;
  for (std::string line; in && in->read_line(line) && in->line_ended();) {
    head.bytes = in->offset();
    if (line.starts_with("# ")) {
      head.lines += line + '\n';
    } else {
      head.columns = std::move(line);
      return head;
    }
  }
  return std::nullopt;  // truncated before its first row
}

tl::expected<LogPager::PartRows, RowRefusal> LogPager::rows_of(const Part& part, std::uint64_t behind,
                                                               std::uint64_t most, bool with_header) {
  const StoredSegment& segment = *part.segment;
  const auto file = open_input(segment.path);
  std::error_code ignored;
  if (!file && std::filesystem::is_regular_file(std::filesystem::symlink_status(segment.path, ignored)))
    return refused(config::kFailed, "rows: " + file.error().text());
  const std::optional<Head> head = file && part.is_readable ? head_of(segment) : std::nullopt;
  if (!head) return PartRows{{}, 0, 0, {}};
  PartRows found = read_rows(segment, head->bytes, behind, most);
  if (found.rows == 0) return found;
  found.json =
      fmt::format("{{\"segment\":{},\"file\":{},\"metadata\":{{{}}},{}\"columns\":{},\"first\":{},\"rows\":[{}]}}",
                  segment.number, json_text(json(segment.file)), metadata_json(head->lines),
                  with_header ? "\"header\":" + json_text(json(head->lines)) + "," : "", text_json(head->columns),
                  behind + 1, found.json);
  return found;
}

LogPager::PartRows LogPager::read_rows(const StoredSegment& segment, std::uint64_t begin, std::uint64_t behind,
                                       std::uint64_t most) {
  PartRows found;
  auto in = FileReader::open(segment.path);
  if (!in) return found;
  Place place = places_.contains(segment.number) ? places_[segment.number] : Place{};
  if (place.row > behind || place.offset == 0) place = {0, begin};
  in->seek(place.offset);
  std::string line;
  const auto next_row = [&] {
    do {
      if (!in->read_line(line) || !in->line_ended()) return false;
    } while (line.starts_with('#'));
    ++place.row, place.offset = in->offset();
    return true;
  };
  bool more = true;
  while (more && place.row < behind) more = next_row();
  while (more && found.rows < most && found.json.size() < kMostBytes) {
    more = next_row();
    if (more) found.json += (found.rows++ > 0 ? "," : "") + text_json(line);
  }
  if (!more) found.in_file = place.row;
  if (in->error()) found.why = in->error()->text();
  places_[segment.number] = place;
  return found;
}

void LogPager::report_loss(const Part& part, const PartRows& found) {
  if (!reported_.insert(part.segment->number).second) return;
  segments_.report(pipeline::Severity::kWarning, "log_damaged",
                   fmt::format("log: {}: found {} of {} rows that were written; the others are missing for clients{}",
                               part.segment->file, *found.in_file, part.end - part.before,
                               found.why.empty() ? "" : "; " + found.why));
}

}  // namespace prism::log
