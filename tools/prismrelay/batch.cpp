// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/sensors.hpp"
#include "tools/client/response.hpp"

namespace prism::prismrelay {
namespace {

using compensation::ColumnInfo;
using compensation::ColumnType;
using compensation::kColumnInfo;
using nlohmann::json;

constexpr std::size_t kMaxNameBytes = 128;
constexpr std::size_t kMaxFieldBytes = 1000;  // of an event or an invalid line
constexpr double kMaxTime_s = 9.2e9;          // the year 2261
constexpr std::int64_t kDay_ns = 86'400'000'000'000;
constexpr std::size_t kTime = compensation::column_index("time_s"), kArrival = compensation::column_index("arrival_s");

// The times are converted; all other columns have the same name in the log and in prism.rows.
bool is_copied(const ColumnInfo& column) { return column.type != ColumnType::kTime; }

// Replaces what PostgreSQL cannot store.
std::string database_text(std::string_view text) {
  std::string valid = valid_utf8(text);
  for (std::size_t at = 0; (at = valid.find('\0', at)) != std::string::npos;) valid.replace(at, 1, "\xef\xbf\xbd");
  return valid;
}

// JSON whose texts PostgreSQL can store.
std::string database_json(const json& value) {
  std::string text = json_text(value);  // without invalid UTF-8
  for (std::size_t at = 0; (at = text.find('\\', at)) != std::string::npos; at += 2) {
    if (text.compare(at, 6, "\\u0000") == 0) text.replace(at, 6, "\xef\xbf\xbd");
  }
  return text;
}

// Fields of a line. Empty lines have one field.
std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t comma; (comma = line.find(',')) != std::string_view::npos; line.remove_prefix(comma + 1))
    fields.push_back(line.substr(0, comma));
  fields.push_back(line);
  return fields;
}

// The types are those of the columns in schema/*.sql.
bool is_valid(ColumnType type, std::string_view text) {
  if (type == ColumnType::kText)
    return text.size() <= 200 && text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_+") == std::string_view::npos;
  if (type == ColumnType::kReal) return parse_number<double>(text).has_value();
  const std::int64_t max = type == ColumnType::kInteger ? INT32_MAX : type == ColumnType::kFlag ? INT16_MAX : INT64_MAX;
  const auto value = parse_number<std::int64_t>(text);
  return value && *value >= -max && *value <= max;
}

// Rounded as PostgreSQL's to_timestamp: earlier versions stored the times with it, and the arrival is part of a key.
std::int64_t rounded_ns(double time_s) {
  constexpr std::int64_t kEpoch_s = 946'684'800;  // of PostgreSQL: 2000
  return (static_cast<std::int64_t>(std::rint((time_s - kEpoch_s) * 1e6)) + kEpoch_s * 1'000'000) * 1000;
}

std::string time_text(double time_s) { return utc_nano_text(rounded_ns(time_s)); }

std::string in_quotes(std::string_view text) { return "\"" + shortened(text, 40) + "\""; }

/// Converts the rows of one segment. Checks every value, so that the server refuses few.
class RowConverter {
 public:
  /// `columns`: the header line of the segment. Columns are identified by name; unknown ones are skipped.
  explicit RowConverter(std::string_view columns) {
    field_of_.fill(-1);
    const auto names = split(columns);
    sensors_.resize(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const bool is_plain = std::all_of(names[i].begin(), names[i].end(),
                                        [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '.'; });
      if (const std::size_t column = compensation::column_index(names[i]); column < kColumnInfo.size()) {
        field_of_[column] = static_cast<int>(i);
      } else if (is_plain && sensor_of_column(names[i])) {
        sensors_[i] = names[i];
      }
    }
  }

  /// Appends record.line to `csv`, and sets record.arrival_s. Returns an error and appends nothing if a field is
  /// invalid for the type of its column.
  std::optional<std::string> append(std::string& csv, std::string_view prefix, Record& record) const {
    const auto fields = split(record.line);
    if (fields.size() != sensors_.size())
      return fmt::format("found {} fields, expected {}", fields.size(), sensors_.size());
    const auto at = [&](std::size_t column) {
      return field_of_[column] < 0 ? std::string_view() : fields[field_of_[column]];
    };
    const auto time_s = parse_number<double>(at(kTime));
    if (!time_s || std::abs(*time_s) > kMaxTime_s) return "time_s: found " + in_quotes(at(kTime));
    const std::string_view arrival_text = at(at(kArrival).empty() ? kTime : kArrival);  // logs of 0.1 have no arrival
    const auto arrival_s = parse_number<double>(arrival_text);
    if (!arrival_s || !(*arrival_s >= 0 && *arrival_s < kMaxTime_s))
      return "arrival_s: found " + in_quotes(arrival_text);
    for (std::size_t c = 0; c < kColumnInfo.size(); ++c) {
      if (is_copied(kColumnInfo[c]) && !at(c).empty() && !is_valid(kColumnInfo[c].type, at(c)))
        return fmt::format("{}: found {}", kColumnInfo[c].name, in_quotes(at(c)));
    }
    std::string sensors;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (sensors_[i].empty() || fields[i].empty()) continue;
      const auto value = parse_number<double>(fields[i]);
      if (!value) return fmt::format("{}: found {}", sensors_[i], in_quotes(fields[i]));
      // Formats the value again, because JSON does not allow .5.
      fmt::format_to(std::back_inserter(sensors), "{}\"\"{}\"\":{}", sensors.empty() ? "" : ",", sensors_[i], *value);
    }
    record.arrival_s = *arrival_s;
    fmt::format_to(std::back_inserter(csv), "{}{},{},{},", prefix, record.row, time_text(*arrival_s),
                   time_text(*time_s));
    if (!sensors.empty()) ((csv += "\"{") += sensors) += "}\"";
    for (std::size_t c = 0; c < kColumnInfo.size(); ++c) {
      if (is_copied(kColumnInfo[c])) (csv += ',') += at(c);
    }
    csv += '\n';
    return std::nullopt;
  }

 private:
  std::array<int, kColumnInfo.size()> field_of_;  ///< index of the line's field, −1: absent
  std::vector<std::string> sensors_;              ///< by index of the line's field; empty: not a sensor
};

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
  const std::string log = text_member(page, "log"), after = text_member(page, "after");
  const json& segments = member(page, "segments");
  return log.size() == 32 && log.find_first_not_of("0123456789abcdef") == std::string::npos && !after.empty() &&
         follows(TextRule::kText, after) && member(page, "more").is_boolean() &&
         member(page, "missing").is_number_unsigned() && segments.is_array() &&
         std::all_of(segments.begin(), segments.end(), is_segment);
}

// Gyro and axis as CSV fields, each followed by a comma.
std::string key_fields(const LogKey& log) {
  std::string fields;
  append_quoted(fields, log.gyro);
  append_quoted(fields += ',', log.axis);
  return fields += ',';
}

void add_gap(BatchItem& item, const char* kind, const std::string& cursor) {
  std::string& text = item.text(Table::kGaps);
  append_quoted(text += key_fields(item.log) + kind + ',', cursor);
  text += fmt::format(",{}\n", item.missing);
  item.of(Table::kGaps).emplace_back();
}

void add_refused(BatchItem& item, const Record& record, const std::string& reason) {
  std::string& text = item.text(Table::kRefused);
  text += fmt::format("{}{},{},{},", key_fields(item.log), item.log_id, record.segment, record.row);
  append_quoted(text, reason, kMaxFieldBytes);
  append_quoted(text += ',', record.line, kMaxFieldBytes);
  text += '\n';
}

void add_segment(BatchItem& item, const json& segment) {
  Record record;
  record.segment = count_member(segment, "segment"), record.row = count_member(segment, "first");
  const std::string prefix = fmt::format("{}{},{},", key_fields(item.log), item.log_id, record.segment);
  const json& metadata = member(segment, "metadata");
  std::string& text = item.text(Table::kSegments);
  append_quoted(text += prefix, printable(text_member(segment, "file")), kMaxFieldBytes);
  text += ',';
  if (member(metadata, "model").is_string()) append_quoted(text, text_member(metadata, "model"), kMaxFieldBytes);
  append_quoted(text += ',', metadata.is_object() ? database_json(metadata) : "{}");
  text += '\n';
  item.of(Table::kSegments)
      .push_back({.segment = record.segment, .line = member(segment, "file").get_ref<const std::string&>()});
  const RowConverter converter(member(segment, "columns").get_ref<const std::string&>());
  for (const json& row : member(segment, "rows")) {
    record.line = row.get_ref<const std::string&>();
    if (const auto error = converter.append(item.text(Table::kRows), prefix, record)) {
      ++item.invalid;
      item.error = fmt::format("row {} of segment {}: {}", record.row, record.segment, shortened(*error, 200));
      add_refused(item, record, *error);
    } else {
      item.days.insert(rounded_ns(record.arrival_s) / kDay_ns);
      item.of(Table::kRows).push_back(record);
    }
    ++record.row;
  }
}

}  // namespace

void BatchItem::refuse(Table table, Record& record, const std::string& reason) {
  record.is_refused = true;
  const bool is_row = table == Table::kRows, is_segment = table == Table::kSegments;
  if (is_row || is_segment) add_refused(*this, record, reason);
  if (!refusal.empty()) return;
  refusal = is_row       ? fmt::format("row {} of segment {}", record.row, record.segment)
            : is_segment ? fmt::format("metadata of segment {}", record.segment)
                         : std::string(table == Table::kGaps ? "a gap" : "an event");
  refusal += ": " + shortened(reason, 300);
}

std::size_t BatchItem::refused_rows() const {
  return static_cast<std::size_t>(std::ranges::count_if(of(Table::kRows), &Record::is_refused));
}

Result<std::shared_ptr<BatchItem>> page_item(const LogKey& log, const std::string& cursor, json response) {
  auto item = std::make_shared<BatchItem>();
  item->source = std::move(response);
  const json& page = client::of_axis(item->source, log.axis);
  if (!is_page(page))
    return make_error(log.gyro, "invalid response to rows; expected log, segments, after, more and missing");
  item->log = log;
  item->log_id = text_member(page, "log");
  item->cursor = text_member(page, "after");
  item->more = flag_member(page, "more");
  item->missing = std::min<std::uint64_t>(count_member(page, "missing"), INT64_MAX);  // the column is a bigint
  for (const json& segment : member(page, "segments")) add_segment(*item, segment);
  if (item->missing > 0) add_gap(*item, "deleted", cursor);
  return item;
}

std::shared_ptr<BatchItem> change_item(const LogKey& log, const std::string& cursor) {
  auto item = std::make_shared<BatchItem>();
  item->log = log;
  add_gap(*item, "log_changed", cursor);
  return item;
}

std::shared_ptr<BatchItem> event_item(const std::string& gyro, const json& event) {
  const json& time = member(event, "time_s");
  if (!time.is_number() || !(std::abs(time.get<double>()) < kMaxTime_s)) return nullptr;
  auto item = std::make_shared<BatchItem>();
  item->log.gyro = gyro;
  std::string& text = item->text(Table::kEvents);
  append_quoted(text, gyro);
  text += fmt::format(",{}", time_text(time.get<double>()));
  // Kind and text are in a key: PostgreSQL limits an index entry to 2700 bytes.
  append_quoted(text += ',', text_member(event, "severity", "-"), kMaxNameBytes);
  append_quoted(text += ',', text_member(event, "kind", "-"), kMaxNameBytes);
  append_quoted(text += ',', text_member(event, "text", "-"), kMaxFieldBytes);
  text += '\n';
  item->of(Table::kEvents).emplace_back();
  return item;
}

std::string place_line(const BatchItem& item) {
  if (item.cursor.empty()) return "";
  const Record* last = nullptr;
  std::size_t count = 0;
  for (const Record& row : item.of(Table::kRows)) {
    if (!row.is_refused) last = &row, ++count;
  }
  std::string line = key_fields(item.log);
  append_quoted(line, item.cursor);
  if (last == nullptr) return line + ",,,,,0\n";
  return line +
         fmt::format(",{},{},{},{},{}\n", item.log_id, last->segment, last->row, time_text(last->arrival_s), count);
}

std::string row_columns() {
  std::string text = "gyro, axis, log, segment, row_number, arrival, time, sensors";
  for (const ColumnInfo& column : kColumnInfo) {
    if (is_copied(column)) (text += ", ") += column.name;
  }
  return text;
}

void append_quoted(std::string& csv, std::string_view text, std::size_t max) {
  csv += '"';
  for (const char c : database_text(utf8_prefix(text, max))) {
    if (c == '"') csv += '"';
    csv += c;
  }
  csv += '"';
}

}  // namespace prism::prismrelay
