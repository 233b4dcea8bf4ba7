// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "tools/prismrelay/row_converter.hpp"
#include "tools/prismrelay/sql_text.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNameBytes = 128;
constexpr std::size_t kMaxFieldBytes = 1000;  // of an event or an invalid line

bool is_log_id(const json& id) {
  if (!id.is_string()) return false;
  const auto& text = id.get_ref<const std::string&>();
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// Limits the length of a cursor, because it is part of a key.
bool is_cursor(const json& cursor) {
  const auto* text = cursor.get_ptr<const std::string*>();
  return text != nullptr && !text->empty() && follows(TextRule::kText, *text);
}

bool is_segment(const json& segment) {
  const auto number = [&](const char* key) {
    const json& value = member(segment, key);
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= INT32_MAX;
  };
  const json& rows = member(segment, "rows");
  return number("segment") && number("first") && member(segment, "file").is_string() &&
         member(segment, "columns").is_string() && rows.is_array() &&
         std::all_of(rows.begin(), rows.end(), [](const json& row) { return row.is_string(); });
}

bool is_page(const json& page) {
  const json& segments = member(page, "segments");
  return is_log_id(member(page, "log")) && is_cursor(member(page, "after")) && member(page, "more").is_boolean() &&
         member(page, "missing").is_number_unsigned() && segments.is_array() &&
         std::all_of(segments.begin(), segments.end(), is_segment);
}

std::string gyro_and_axis(const LogKey& log) {
  std::string fields;
  append_quoted(fields, log.gyro);
  fields += ',';
  append_quoted(fields, log.axis);
  return fields;
}

}  // namespace

Result<PageSummary> Batch::add_page(const LogKey& log, const std::string& cursor, const json& page) {
  if (!is_page(page))
    return make_error(log.gyro, "invalid response to rows; expected log, segments, after, more and missing");
  const std::string key = gyro_and_axis(log), id = text_member(page, "log");
  PageSummary summary;
  summary.cursor = text_member(page, "after");
  summary.more = flag_member(page, "more");
  summary.missing = count_member(page, "missing");
  RowPosition last;
  const std::string prefix = fmt::format("{},{},", key, id);
  for (const json& segment : member(page, "segments")) add_segment(prefix, segment, summary, last);
  if (summary.missing > 0) {
    std::string& gap = texts_[kGaps];
    gap += key + ",deleted,";
    append_quoted(gap, cursor);
    gap += fmt::format(",{}\n", summary.missing);
  }
  cursors_[log] = summary.cursor;
  std::string& places = texts_[kPlaces];
  places += key + ",";
  append_quoted(places, summary.cursor);
  places += last.row > 0
                ? fmt::format(",{},{},{},{:.6f},{}\n", id, last.segment, last.row, summary.arrival_s, summary.rows)
                : fmt::format(",,,,,{}\n", summary.rows);
  return summary;
}

void Batch::add_segment(const std::string& prefix, const json& segment, PageSummary& summary, RowPosition& last) {
  RowPosition position{prefix, count_member(segment, "segment"), count_member(segment, "first")};
  const json& metadata = member(segment, "metadata");
  std::string& segments = texts_[kSegments];
  segments += fmt::format("{}{},", prefix, position.segment);
  append_quoted(segments, printable(text_member(segment, "file")), kMaxFieldBytes);
  segments += ',';
  if (member(metadata, "model").is_string()) append_quoted(segments, text_member(metadata, "model"), kMaxFieldBytes);
  segments += ',';
  append_quoted(segments, metadata.is_object() ? jsonb_text(metadata) : "{}");
  segments += '\n';
  const std::string columns = text_member(segment, "columns");
  const RowConverter converter(columns);
  for (const json& row : member(segment, "rows")) {
    const std::string& line = row.get_ref<const std::string&>();
    std::int64_t day = 0;
    double arrival_s = 0;
    const std::string error = converter.append(texts_[kRows], position, line, day, arrival_s);
    if (error.empty()) {
      ++summary.rows;
      days_.insert(day);
      summary.arrival_s = arrival_s;
      last.segment = position.segment, last.row = position.row;
    } else {
      ++summary.invalid;
      summary.error = fmt::format("row {} of segment {}: {}", position.row, position.segment, shortened(error, 200));
      std::string& invalid = texts_[kRefused];
      invalid += fmt::format("{}{},{},", prefix, position.segment, position.row);
      append_quoted(invalid, error, kMaxFieldBytes);
      invalid += ',';
      append_quoted(invalid, line, kMaxFieldBytes);
      invalid += '\n';
    }
    ++position.row;
  }
}

void Batch::add_change_of_log(const LogKey& log, const std::string& cursor) {
  std::string& gap = texts_[kGaps];
  gap += gyro_and_axis(log) + ",log_changed,";
  append_quoted(gap, cursor);
  gap += ",0\n";
}

void Batch::add_event(const std::string& gyro, const json& event) {
  const json& time = member(event, "time_s");
  if (!time.is_number() || !(std::abs(time.get<double>()) < 9.2e9)) return;
  std::string& csv = texts_[kEvents];
  append_quoted(csv, gyro);
  csv += fmt::format(",{:.6f}", time.get<double>());
  const auto add = [&](const char* name, std::size_t max) {
    csv += ',';
    append_quoted(csv, text_member(event, name, "-"), max);
  };
  add("severity", kMaxNameBytes);  // kind and text are in a key: PostgreSQL limits an index entry to 2700 bytes
  add("kind", kMaxNameBytes);
  add("text", kMaxFieldBytes);
  csv += '\n';
}

bool Batch::empty() const {
  return std::all_of(texts_.begin(), texts_.end(), [](const std::string& text) { return text.empty(); });
}

std::size_t Batch::bytes() const {
  return std::accumulate(texts_.begin(), texts_.end(), std::size_t{0},
                         [](std::size_t sum, const std::string& text) { return sum + text.size(); });
}

}  // namespace prism::prismrelay
