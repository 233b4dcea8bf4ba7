// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

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
         count_member(segment, "first") + rows.size() <= INT32_MAX &&
         std::all_of(rows.begin(), rows.end(), [](const json& row) { return row.is_string(); });
}

bool is_page(const json& page) {
  const json& segments = member(page, "segments");
  return is_log_id(member(page, "log")) && is_cursor(member(page, "after")) && member(page, "more").is_boolean() &&
         member(page, "missing").is_number_unsigned() && segments.is_array() &&
         std::all_of(segments.begin(), segments.end(), is_segment);
}

// A record of refused_rows.
void append_refused_row(std::string& csv, const RowPosition& position, const std::string& reason,
                        std::string_view line) {
  csv += fmt::format("{}{},{},", position.prefix, position.segment, position.row);
  append_quoted(csv, reason, kMaxFieldBytes);
  csv += ',';
  append_quoted(csv, line, kMaxFieldBytes);
  csv += '\n';
}

std::string gyro_and_axis(const LogKey& log) {
  std::string fields;
  append_quoted(fields, log.gyro);
  fields += ',';
  append_quoted(fields, log.axis);
  return fields;
}

}  // namespace

Record& BatchItem::add(Table table, std::size_t begin) {
  Record record;
  record.table = table;
  record.csv = begin;
  record.csv_bytes = csv.size() - begin;
  return records.emplace_back(record);
}

void append_place(CopyTexts& texts, const BatchItem& item, const std::vector<const Record*>& rows) {
  std::string& places = texts[static_cast<std::size_t>(Table::kPlaces)];
  places += item.key + ",";
  append_quoted(places, item.cursor);
  if (rows.empty()) {
    places += ",,,,,0\n";
  } else {
    const Record& last = *rows.back();
    places += fmt::format(",{},{},{},{:.6f},{}\n", item.log_id, last.segment, last.row, last.arrival_s, rows.size());
  }
}

void append_refused(CopyTexts& texts, const BatchItem& item, const Record& record, const std::string& reason) {
  std::string_view line = record.table == Table::kRows ? item.line_of(record) : item.csv_of(record);
  if (line.ends_with('\n')) line.remove_suffix(1);
  const std::string prefix = fmt::format("{},{},", item.key, item.log_id);
  append_refused_row(texts[static_cast<std::size_t>(Table::kRefused)], {prefix, record.segment, record.row}, reason,
                     line);
}

Result<PageSummary> Batch::add_page(const LogKey& log, const std::string& cursor, const json& page) {
  if (!is_page(page))
    return make_error(log.gyro, "invalid response to rows; expected log, segments, after, more and missing");
  BatchItem item{log, gyro_and_axis(log), text_member(page, "log"), text_member(page, "after"), {}, {}, {}};
  PageSummary summary;
  summary.cursor = item.cursor;
  summary.more = flag_member(page, "more");
  summary.missing = std::min<std::uint64_t>(count_member(page, "missing"), INT64_MAX);  // the column is a bigint
  for (const json& segment : member(page, "segments")) add_segment(item, segment, summary);
  if (summary.missing > 0) {
    const std::size_t begin = item.csv.size();
    item.csv += item.key + ",deleted,";
    append_quoted(item.csv, cursor);
    item.csv += fmt::format(",{}\n", summary.missing);
    item.add(Table::kGaps, begin);
  }
  bytes_ += item.csv.size() + item.cursor.size();
  items_.push_back(std::move(item));
  return summary;
}

void Batch::add_segment(BatchItem& item, const json& segment, PageSummary& summary) {
  const std::string prefix = fmt::format("{},{},", item.key, item.log_id);
  RowPosition position{prefix, count_member(segment, "segment"), count_member(segment, "first")};
  const json& metadata = member(segment, "metadata");
  std::string& csv = item.csv;
  std::size_t begin = csv.size();
  csv += fmt::format("{}{},", prefix, position.segment);
  append_quoted(csv, printable(text_member(segment, "file")), kMaxFieldBytes);
  csv += ',';
  if (member(metadata, "model").is_string()) append_quoted(csv, text_member(metadata, "model"), kMaxFieldBytes);
  csv += ',';
  append_quoted(csv, metadata.is_object() ? jsonb_text(metadata) : "{}");
  csv += '\n';
  item.add(Table::kSegments, begin).segment = position.segment;
  const std::string columns = text_member(segment, "columns");
  const RowConverter converter(columns);
  for (const json& row : member(segment, "rows")) {
    const std::string& line = row.get_ref<const std::string&>();
    Record read;
    begin = csv.size();
    const std::string error = converter.append(csv, position, line, read.day, read.arrival_s);
    if (error.empty()) {
      ++summary.rows;
      summary.arrival_s = read.arrival_s;
      Record& record = item.add(Table::kRows, begin);
      record.line = item.lines.size(), record.line_bytes = std::min(line.size(), kMaxFieldBytes);
      record.segment = position.segment, record.row = position.row;
      record.arrival_s = read.arrival_s, record.day = read.day;
      item.lines.append(line, 0, kMaxFieldBytes);
    } else {
      ++summary.invalid;
      summary.error = fmt::format("row {} of segment {}: {}", position.row, position.segment, shortened(error, 200));
      append_refused_row(csv, position, error, line);
      item.add(Table::kRefused, begin);
    }
    ++position.row;
  }
}

void Batch::add_change_of_log(const LogKey& log, const std::string& cursor) {
  BatchItem item{log, gyro_and_axis(log), {}, {}, {}, {}, {}};
  item.csv = item.key + ",log_changed,";
  append_quoted(item.csv, cursor);
  item.csv += ",0\n";
  item.add(Table::kGaps, 0);
  bytes_ += item.csv.size();
  items_.push_back(std::move(item));
}

void Batch::add_event(const std::string& gyro, const json& event) {
  const json& time = member(event, "time_s");
  if (!time.is_number() || !(std::abs(time.get<double>()) < 9.2e9)) return;
  BatchItem item{{gyro, ""}, {}, {}, {}, {}, {}, {}};
  append_quoted(item.csv, gyro);
  item.csv += fmt::format(",{:.6f}", time.get<double>());
  const auto add = [&](const char* name, std::size_t max) {
    item.csv += ',';
    append_quoted(item.csv, text_member(event, name, "-"), max);
  };
  add("severity", kMaxNameBytes);  // kind and text are in a key: PostgreSQL limits an index entry to 2700 bytes
  add("kind", kMaxNameBytes);
  add("text", kMaxFieldBytes);
  item.csv += '\n';
  item.add(Table::kEvents, 0);
  bytes_ += item.csv.size();
  items_.push_back(std::move(item));
}

CopyTexts Batch::texts(std::size_t first, std::size_t last) const {
  CopyTexts texts;
  for (std::size_t i = first; i < last; ++i) {
    const BatchItem& item = items_[i];
    std::vector<const Record*> rows;
    for (const Record& record : item.records) {
      texts[static_cast<std::size_t>(record.table)] += item.csv_of(record);
      if (record.table == Table::kRows) rows.push_back(&record);
    }
    if (!item.cursor.empty()) append_place(texts, item, rows);
  }
  return texts;
}

std::set<std::int64_t> Batch::days() const {
  std::set<std::int64_t> days;
  for (const BatchItem& item : items_) {
    for (const Record& record : item.records) {
      if (record.table == Table::kRows) days.insert(record.day);
    }
  }
  return days;
}

}  // namespace prism::prismrelay
