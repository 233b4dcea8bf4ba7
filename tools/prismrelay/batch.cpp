// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <boost/endian/conversion.hpp>
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
#include "tools/client/client.hpp"

namespace prism::prismrelay {
namespace {

using compensation::ColumnType;
using compensation::log_columns;
using compensation::LogColumn;
using nlohmann::json;

constexpr std::size_t kMaxNameBytes = 128;
constexpr std::size_t kMaxFieldBytes = 1000;  // of an event or an invalid line
constexpr double kMaxTime_s = 9.2e9;          // the year 2261
constexpr std::int64_t kDay_ns = 86'400'000'000'000;

// The times are converted; all other columns have the same name in the log and in prism.rows.
bool is_copied(const LogColumn& column) { return column.type != ColumnType::kTime; }

// The last `size` bytes, the most significant one first.
void append_number(std::string& text, std::int64_t value, std::size_t size) {
  const auto bytes = std::bit_cast<std::array<char, 8>>(boost::endian::native_to_big(value));
  text.append(bytes.end() - size, bytes.end());
}

// A field of COPY's binary format is its size and its bytes; the size -1 is null.
void append_field(std::string& text, std::int64_t value, std::size_t size) {
  append_number(text, static_cast<std::int64_t>(size), 4);
  append_number(text, value, size);
}

void append_text(std::string& text, std::string_view value) {
  append_number(text, static_cast<std::int64_t>(value.size()), 4);
  text += value;
}

void append_null(std::string& text) { append_number(text, -1, 4); }

// Microseconds since 2000 UTC.
void append_time(std::string& text, std::int64_t time_ns) {
  append_field(text, time_ns / 1000 - 946'684'800'000'000, 8);
}

// JSON whose texts PostgreSQL can store.
std::string database_json(const json& value) {
  std::string text = json_text(value);  // without invalid UTF-8
  for (std::size_t at = 0; (at = text.find('\\', at)) != std::string::npos; at += 2) {
    if (text.compare(at, 6, "\\u0000") == 0) text.replace(at, 6, "\xef\xbf\xbd");
  }
  return text;
}

/// Converts the rows of one segment with the reader of the log, which checks every value: so the server refuses few.
class RowConverter {
 public:
  /// Columns are identified by name; unknown ones are skipped.
  explicit RowConverter(const json& segment) {
    const std::string columns = text_member(segment, "columns");
    has_partial_ = columns.ends_with(",partial");
    const std::string listed = text_member(member(segment, "metadata"), "sensors");
    std::vector<SensorName> sensors = compensation::listed_sensors(listed);
    std::erase_if(sensors, [](const SensorName& sensor) { return !is_sensor_name(sensor.name); });
    layout_ = compensation::CsvLayout::parse(columns, "", std::make_shared<const std::vector<SensorName>>(sensors));
  }

  /// Appends record.line to `text`, after `prefix`, and sets record.arrival_ns. Returns an error and appends nothing if
  /// the line is not a row.
  std::optional<std::string> append(std::string& text, std::string_view prefix, Record& record) {
    if (!layout_) return layout_.error().what;
    if (const auto read = compensation::read_csv(record.line, "", *layout_, row_); !read) return read.error().what;
    const compensation::SecondMean& second = row_.window.second_mean;
    const std::int64_t time_ns = (second.second + 1) * 1'000'000'000;
    record.arrival_ns = second.arrival_ns > 0 ? second.arrival_ns : time_ns;  // logs of 0.1 have no arrival
    if (record.arrival_ns < 0) return "found a time before 1970";
    if (second.samples > INT32_MAX)
      return fmt::format("found {} samples, expected at most {}", second.samples, INT32_MAX);
    std::string sensors;
    for (std::size_t i = 0; i < second.sensors.size(); ++i) {
      if (!std::isfinite(second.sensors[i])) continue;
      fmt::format_to(std::back_inserter(sensors), "{}\"{}\":{}", sensors.empty() ? "\1{" : ",",  // 1: version of jsonb
                     sensor_column((*second.sensor_list)[i]), second.sensors[i]);
    }
    text += prefix;
    append_field(text, static_cast<std::int64_t>(record.row), 4);
    append_time(text, record.arrival_ns);
    append_time(text, time_ns);
    sensors.empty() ? append_null(text) : append_text(text, sensors += '}');
    for (const LogColumn& column : log_columns()) append_column(text, column);
    return std::nullopt;
  }

 private:
  void append_column(std::string& text, const LogColumn& column) {
    if (!is_copied(column)) return;
    if (column.type == ColumnType::kReal) {
      const double value = column.value(row_);
      return std::isfinite(value) ? append_field(text, std::bit_cast<std::int64_t>(value), 8) : append_null(text);
    }
    if (column.type == ColumnType::kText) {
      std::string value;
      column.append(value, row_);
      return append_text(text, value);
    }
    const std::int64_t number = column.number(row_);
    if (column.type == ColumnType::kFlag) return has_partial_ ? append_field(text, number, 2) : append_null(text);
    append_field(text, number, column.type == ColumnType::kInteger ? 4 : 8);
  }

  bool has_partial_ = false;
  Result<compensation::CsvLayout> layout_;
  compensation::CompensatedWindow row_;  ///< the last one
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
std::string key_fields(const LogKey& log) { return csv_text(log.gyro) + ',' + csv_text(log.axis) + ','; }

void add_gap(BatchItem& item, const char* kind, const std::string& cursor) {
  std::string& text = item.texts[kGaps];
  text += fmt::format("{}{},{},{}\n", key_fields(item.log), kind, csv_text(cursor), item.missing);
  item.records[kGaps].push_back({.end = text.size()});
}

void add_refused(BatchItem& item, const Record& record, const std::string& reason) {
  item.texts[kRefused] +=
      fmt::format("{}{},{},{},{},{}\n", key_fields(item.log), item.log_id, record.segment, record.row,
                  csv_text(reason, kMaxFieldBytes), csv_text(record.line, kMaxFieldBytes));
}

void add_segment(BatchItem& item, const json& segment) {
  Record record;
  record.segment = count_member(segment, "segment"), record.row = count_member(segment, "first");
  const json& metadata = member(segment, "metadata");
  std::string& text = item.texts[kSegments];
  const bool has_model = member(metadata, "model").is_string();
  text += fmt::format("{}{},{},{},{},{}\n", key_fields(item.log), item.log_id, record.segment,
                      csv_text(printable(text_member(segment, "file")), kMaxFieldBytes),
                      has_model ? csv_text(text_member(metadata, "model"), kMaxFieldBytes) : "",
                      metadata.is_object() ? csv_text(database_json(metadata)) : "{}");
  item.records[kSegments].push_back(
      {.segment = record.segment, .line = member(segment, "file").get_ref<const std::string&>(), .end = text.size()});
  std::string prefix;  // of a row: the number of its fields, and the first ones
  append_number(prefix, 8 + std::ranges::count_if(log_columns(), is_copied), 2);
  append_text(prefix, item.log.gyro);
  append_text(prefix, item.log.axis);
  const std::vector<std::uint8_t> log_id = hex_bytes(item.log_id);
  append_text(prefix, {reinterpret_cast<const char*>(log_id.data()), log_id.size()});
  append_field(prefix, static_cast<std::int64_t>(record.segment), 4);
  RowConverter converter(segment);
  const json& rows = member(segment, "rows");
  item.records[kRows].reserve(rows.size());
  for (const json& row : rows) {
    record.line = row.get_ref<const std::string&>();
    if (const auto error = converter.append(item.texts[kRows], prefix, record)) {
      ++item.invalid;
      item.error = fmt::format("row {} of segment {}: {}", record.row, record.segment, shortened(*error, 200));
      add_refused(item, record, *error);
    } else {
      record.end = item.texts[kRows].size();
      item.days.insert(record.arrival_ns / kDay_ns);
      item.records[kRows].push_back(record);
    }
    ++record.row;
  }
}

}  // namespace

void BatchItem::refuse(Table table, Record& record, const std::string& reason) {
  record.is_refused = true;
  const bool is_row = table == kRows, is_segment = table == kSegments;
  if (is_row || is_segment) add_refused(*this, record, reason);
  if (!refusal.empty()) return;
  refusal = is_row       ? fmt::format("row {} of segment {}", record.row, record.segment)
            : is_segment ? fmt::format("metadata of segment {}", record.segment)
                         : std::string(table == kGaps ? "a gap" : "an event");
  refusal += ": " + shortened(reason, 300);
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
  if (!item->is_empty()) item->texts[kPlaces] = place_line(*item);
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
  std::string& text = item->texts[kEvents];
  // Kind and text are in a key: PostgreSQL limits an index entry to 2700 bytes.
  const auto field = [&](const char* key, std::size_t max) { return csv_text(text_member(event, key, "-"), max); };
  text = fmt::format("{},{},{},{},{}\n", csv_text(gyro), utc_nano_text(std::llround(time.get<double>() * 1e6) * 1000),
                     field("severity", kMaxNameBytes), field("kind", kMaxNameBytes), field("text", kMaxFieldBytes));
  item->records[kEvents].push_back({.end = text.size()});
  return item;
}

std::string place_line(const BatchItem& item) {
  if (item.cursor.empty()) return "";  // an event or the change of a log
  const Record* last = nullptr;
  std::size_t count = 0;
  for (const Record& row : item.records[kRows]) {
    if (!row.is_refused) last = &row, ++count;
  }
  const std::string line = key_fields(item.log) + csv_text(item.cursor);
  if (last == nullptr) return line + ",,,,,0\n";
  return line + fmt::format(",{},{},{},{},{}\n", item.log_id, last->segment, last->row, utc_nano_text(last->arrival_ns),
                            count);
}

std::string row_columns() {
  std::string text = "gyro, axis, log, segment, row_number, arrival, time, sensors";
  for (const LogColumn& column : log_columns()) {
    if (is_copied(column)) (text += ", ") += column.name;
  }
  return text;
}

std::string csv_text(std::string_view text, std::size_t max) {
  std::string csv = "\"";
  for (const char c : valid_utf8(utf8_prefix(text, max))) {
    if (c == '"') csv += '"';
    if (c != '\0') csv += c;
    if (c == '\0') csv += "\xef\xbf\xbd";
  }
  return csv += '"';
}

}  // namespace prism::prismrelay
