// SPDX-License-Identifier: MIT
#include "daemon/log/log_pager.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::log {
namespace {

using nlohmann::json;

constexpr std::size_t kRemembered = 64;  // cached places

// "FILE from row 7"
void take_superseded(const std::string& text, std::string& file, std::uint64_t& row) {
  constexpr std::string_view kBetween = " from row ";
  const std::size_t at = text.find(kBetween);
  if (at == std::string::npos) return;
  const char* first = text.data() + at + kBetween.size();
  if (std::from_chars(first, text.data() + text.size(), row).ec == std::errc()) file = text.substr(0, at);
}

// Rows written by prism need no escape; a segment that a user edited may.
std::string text_json(const std::string& line) {
  const bool plain = std::all_of(line.begin(), line.end(),
                                 [](unsigned char c) { return c >= 0x20 && c < 0x7f && c != '"' && c != '\\'; });
  return plain ? '"' + line + '"' : json_text(json(line));
}

tl::unexpected<RowRefusal> refused(RowRefusal::Why why, std::string text) {
  return tl::unexpected(RowRefusal{why, std::move(text)});
}

template <class Map>
void keep_few(Map& map) {
  while (map.size() > kRemembered) map.erase(map.begin());
}

}  // namespace

// A page ends before a gap, so that `missing` is always a gap before its first row.
RowResult LogPager::page(const RowQuery& query, const OpenSegment& open) {
  const std::vector<Part> all = parts(open);
  const std::uint64_t deleted = segments_.deleted_rows();
  const auto begin = resolve(query.after, all, deleted);
  if (!begin) return tl::unexpected(begin.error());
  RowPage page;
  page.after = *begin;
  if (deleted > begin->total && std::exchange(gone_, *begin) != *begin) page.gone = deleted - begin->total;
  page.json = fmt::format("{{\"log\":\"{}\",\"segments\":[", segments_.id());
  const std::size_t head_bytes = page.json.size();
  const auto lose = [&](const Part& part) {
    page.missing += part.end() - std::min(part.end(), page.after.total);
    page.after = {segments_.id(), part.segment.number, part.segment.rows, part.end()};
  };
  for (const Part& part : all) {
    const std::uint64_t behind = part.segment.number == begin->segment ? begin->row : 0;
    if (part.segment.number < begin->segment || behind >= part.segment.rows) continue;
    const std::uint64_t gap = part.before + behind - std::min(part.before + behind, page.after.total);
    const bool removed = part.segment.path.empty();  // by hand
    const bool full = page.rows >= query.limit || page.json.size() - head_bytes >= kMostBytes;
    if (full || (page.rows > 0 && (gap > 0 || removed))) break;
    if (removed) {
      lose(part);
      continue;
    }
    const std::uint64_t most = std::min<std::uint64_t>(query.limit - page.rows, part.segment.rows - behind);
    const auto found = rows_of(part.segment, behind, most, query.header);
    if (!found && page.rows > 0) break;
    if (!found) return tl::unexpected(found.error());
    page.missing += gap;
    page.json += (page.rows > 0 && found->rows > 0 ? "," : "") + found->json;
    page.rows += found->rows;
    page.after = {segments_.id(), part.segment.number, behind + found->rows, part.before + behind + found->rows};
    if (found->rows == most) continue;
    if (found->in_file) report_loss(part.segment, *found);
    if (!found->in_file || page.rows > 0) break;
    lose(part);
  }
  const std::uint64_t end = all.empty() ? deleted : all.back().end();
  page.json += fmt::format("],\"after\":\"{}\",\"more\":{},\"missing\":{},\"behind\":{},\"kept\":{},\"deleted\":{}",
                           page.after.text(), page.after.total < end, page.missing,
                           end - std::min(end, page.after.total), end - deleted, deleted);
  keep_few(places_);
  return page;
}

tl::expected<RowCursor, RowRefusal> LogPager::resolve(const std::string& after, const std::vector<Part>& parts,
                                                      std::uint64_t first_total) {
  using Why = RowRefusal::Why;
  const std::string& id = segments_.id();
  if (id.empty()) return refused(Why::kUnreadable, "rows: the log has no index yet");
  if (after.empty() || after == "earliest" || (after == "latest" && parts.empty()))
    return RowCursor{id, 0, 0, first_total};
  if (after == "latest") {
    const Part& last = parts.back();
    return RowCursor{id, last.segment.number, last.segment.rows, last.end()};
  }
  auto cursor = RowCursor::parse(after);
  if (!cursor)
    return refused(
        Why::kBadCursor,
        fmt::format("rows: found cursor \"{:.80}\", expected one that rows returned, \"earliest\" or \"latest\"",
                    after));
  if (cursor->log != id) {
    return refused(Why::kForeignCursor,
                   fmt::format("rows/after: found a cursor of log {:.8}, expected one of log {:.8}: the directory was "
                               "emptied or replaced; use \"earliest\" to read it from the start",
                               cursor->log, id));
  }
  const auto own = std::find_if(parts.begin(), parts.end(),
                                [&](const Part& part) { return part.segment.number == cursor->segment; });
  const bool beyond = own != parts.end() ? cursor->row > own->segment.rows && !own->segment.path.empty()
                                         : !parts.empty() && cursor->segment > parts.back().segment.number;
  if (beyond)
    return refused(Why::kForeignCursor, fmt::format("rows/after: found a cursor after row {} of segment {}, which the "
                                                    "log does not have; use \"earliest\" to read it from the start",
                                                    cursor->row, cursor->segment));
  return *cursor;
}

// A segment without an end line has the rows up to its last complete one. Rows that were written again count in the new
// segment only.
std::vector<LogPager::Part> LogPager::parts(const OpenSegment& open) {
  std::vector<NumberedSegment> segments = segments_.numbered();
  if (std::exchange(log_, segments_.id()) != segments_.id()) {  // its numbers are those of other files
    heads_.clear(), torn_.clear(), places_.clear(), reported_.clear();
  }
  for (NumberedSegment& segment : segments) {
    if (segment.path.empty()) continue;
    if (segment.path == open.path) {
      segment.rows = open.rows;
    } else if (segment.rows == 0) {
      const Head* const head = head_of(segment);
      segment.rows = head != nullptr ? whole_rows(segment, *head) : 0;
    }
  }
  limit_superseded(segments);
  std::vector<Part> parts;
  std::uint64_t before = segments_.deleted_rows();
  for (NumberedSegment& segment : segments) {
    parts.push_back({std::move(segment), before});
    before = parts.back().end();
  }
  return parts;
}

void LogPager::limit_superseded(std::vector<NumberedSegment>& segments) {
  for (std::size_t i = 1; i < segments.size(); ++i) {
    const Head* const head = segments[i].path.empty() ? nullptr : head_of(segments[i]);
    if (head == nullptr || head->supersedes_file.empty()) continue;
    for (std::size_t before = 0; before < i; ++before) {
      if (segments[before].file == head->supersedes_file)
        segments[before].rows =
            std::min(segments[before].rows, head->supersedes_row - std::min<std::uint64_t>(head->supersedes_row, 1));
    }
  }
}

const LogPager::Head* LogPager::head_of(const NumberedSegment& segment) {
  if (const auto known = heads_.find(segment.number); known != heads_.end()) return &known->second;
  auto in = FileReader::open(segment.path);
  Head head;
  for (std::string line; in && in->read_line(line);) {
    head.bytes = in->offset();
    if (!line.starts_with("# ")) {
      if (!in->line_ended()) return nullptr;  // truncated before its first row
      head.columns = std::move(line);
      return &heads_.insert_or_assign(segment.number, std::move(head)).first->second;
    }
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) continue;
    const std::string key = line.substr(2, colon - 2), value = line.substr(colon + 2);
    if (key == "supersedes") take_superseded(value, head.supersedes_file, head.supersedes_row);
    if (key == "sensor_line") continue;  // this key occurs several times
    head.metadata += (head.metadata.empty() ? "" : ",") + json_text(json(key)) + ":" + json_text(json(value));
  }
  return nullptr;
}

// A crash ended the segment: its rows are synced before a client sees them.
std::uint64_t LogPager::whole_rows(const NumberedSegment& segment, const Head& head) {
  if (const auto known = torn_.find(segment.number); known != torn_.end()) return known->second;
  const int file = ::open(segment.path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const bool safe = ::fdatasync(file) == 0;
  ::close(file);
  if (!safe) return 0;
  auto in = FileReader::open(segment.path);
  if (!in) return 0;
  in->seek(head.bytes);
  std::uint64_t rows = 0;
  for (std::string line; in->read_line(line) && in->line_ended();) rows += !line.starts_with('#');
  segments_.found(segment.file, rows);
  return torn_[segment.number] = rows;
}

namespace {

// The lines above the columns, as a member of a JSON object.
std::string header_member(const std::string& path) {
  std::string lines;
  auto in = FileReader::open(path);
  for (std::string line; in && in->read_line(line) && line.starts_with("# ");) lines += line + '\n';
  return "\"header\":" + json_text(json(lines)) + ",";
}

}  // namespace

tl::expected<LogPager::PartRows, RowRefusal> LogPager::rows_of(const NumberedSegment& segment, std::uint64_t behind,
                                                               std::uint64_t most, bool with_header) {
  const Head* const head = head_of(segment);
  const auto file = open_input(segment.path);
  std::error_code ignored;
  if (!file && std::filesystem::is_regular_file(std::filesystem::symlink_status(segment.path, ignored)))
    return refused(RowRefusal::Why::kUnreadable, "rows: " + file.error().text());
  if (!file || head == nullptr) return PartRows{{}, 0, 0, {}};
  PartRows found = read_rows(segment, *head, behind, most);
  if (found.rows == 0) return found;
  found.json =
      fmt::format("{{\"segment\":{},\"file\":{},\"metadata\":{{{}}},{}\"columns\":{},\"first\":{},\"rows\":[{}]}}",
                  segment.number, json_text(json(segment.file)), head->metadata,
                  with_header ? header_member(segment.path) : "", text_json(head->columns), behind + 1, found.json);
  return found;
}

LogPager::PartRows LogPager::read_rows(const NumberedSegment& segment, const Head& head, std::uint64_t behind,
                                       std::uint64_t most) {
  PartRows found;
  auto in = FileReader::open(segment.path);
  if (!in) return found;
  Place place = places_.contains(segment.number) ? places_[segment.number] : Place{};
  if (place.row > behind || place.offset == 0) place = {0, head.bytes};
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

void LogPager::report_loss(const NumberedSegment& segment, const PartRows& found) {
  if (!reported_.insert(segment.number).second) return;
  segments_.report(pipeline::Severity::kWarning, "log_damaged",
                   fmt::format("log: {}: found {} of {} rows that were written; the others are missing for clients{}",
                               segment.file, *found.in_file, segment.rows, found.why.empty() ? "" : "; " + found.why));
}

}  // namespace prism::log
