// SPDX-License-Identifier: MIT
#include "tools/prismrelay/batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tools/prismrelay/row_converter.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;

constexpr std::size_t kMostText = 1000;  // of an event or a line that is kept as it stands

bool is_log_id(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

const json& member(const json& object, const char* key) {
  static const json nothing;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : nothing;
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

// The server takes neither bytes that are no UTF-8 nor \u0000, in JSON or in text.
std::string dumped(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find("\\u0000", at)) != std::string::npos;) text.replace(at, 6, "?");
  return text;
}

// Cut where a character begins. NUL goes when it is quoted.
std::string_view cut(const std::string& text) {
  std::size_t end = std::min(text.size(), kMostText);
  while (end < text.size() && end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string_view(text).substr(0, end);
}

}  // namespace

Result<PageFacts> Batch::add_page(const LogKey& log, const std::string& cursor, const json& page) {
  const json& segments = member(page, "segments");
  const json& missing = member(page, "missing");
  const bool whole = member(page, "log").is_string() && is_log_id(page["log"]) && member(page, "after").is_string() &&
                     member(page, "more").is_boolean() && missing.is_number_unsigned() && segments.is_array() &&
                     std::all_of(segments.begin(), segments.end(), is_segment);
  if (!whole)
    return refuse(log.gyro, "answered rows with something else, expected log, segments, after, more and missing");
  const std::string id = page["log"];
  PageFacts facts;
  facts.cursor = page["after"];
  facts.more = page["more"];
  facts.missing = missing;
  std::string prefix;
  append_quoted(prefix, log.gyro);
  prefix += ',';
  append_quoted(prefix, log.axis);
  const std::string gyro_axis = prefix;
  prefix += "," + id + ",";
  std::uint64_t last_segment = 0, last_row = 0;
  for (const json& segment : segments) {
    RowPlace place{prefix, segment["segment"], segment["first"]};
    const json& metadata = member(segment, "metadata");
    std::string& head = texts_[kSegments];
    head += fmt::format("{}{},", prefix, place.segment);
    append_quoted(head, cut(segment["file"].get_ref<const std::string&>()));
    head += ',';
    if (const json& model = member(metadata, "model"); model.is_string())
      append_quoted(head, cut(model.get_ref<const std::string&>()));
    head += ',';
    append_quoted(head, metadata.is_object() ? dumped(metadata) : "{}");
    head += '\n';
    const RowConverter converter(segment["columns"].get_ref<const std::string&>());
    for (const json& row : segment["rows"]) {
      const std::string& line = row.get_ref<const std::string&>();
      std::int64_t day = 0;
      const std::string why = converter.append(texts_[kRows], place, line, day, facts.arrival_s);
      if (why.empty()) {
        ++facts.rows;
        days_.insert(day);
        last_segment = place.segment;
        last_row = place.row;
      } else {
        ++facts.refused;
        std::string& refused = texts_[kRefused];
        refused += fmt::format("{}{},{},", prefix, place.segment, place.row);
        append_quoted(refused, cut(why));
        refused += ',';
        append_quoted(refused, cut(line));
        refused += '\n';
      }
      ++place.row;
    }
  }
  if (facts.missing > 0) {
    std::string& gap = texts_[kGaps];
    gap += gyro_axis + ",deleted,";
    append_quoted(gap, cursor);
    gap += fmt::format(",{}\n", facts.missing);
  }
  places_[log] = facts.cursor;
  std::string& place = texts_[kPlaces];
  place += gyro_axis + ",";
  append_quoted(place, facts.cursor);
  place += last_row > 0 ? fmt::format(",{},{},{},{:.6f},{}\n", id, last_segment, last_row, facts.arrival_s, facts.rows)
                        : fmt::format(",,,,,{}\n", facts.rows);
  return facts;
}

void Batch::add_change_of_log(const LogKey& log, const std::string& cursor) {
  std::string& gap = texts_[kGaps];
  append_quoted(gap, log.gyro);
  gap += ',';
  append_quoted(gap, log.axis);
  gap += ",log_changed,";
  append_quoted(gap, cursor);
  gap += ",0\n";
}

void Batch::add_event(const std::string& gyro, const json& event) {
  const json& time = member(event, "time_s");
  if (!time.is_number() || !(std::abs(time.get<double>()) < 9.2e9)) return;
  std::string& csv = texts_[kEvents];
  append_quoted(csv, gyro);
  csv += fmt::format(",{:.6f}", time.get<double>());
  for (const char* key : {"severity", "kind", "text"}) {
    const json& value = member(event, key);
    csv += ',';
    append_quoted(csv, value.is_string() ? cut(value.get_ref<const std::string&>()) : "-");
  }
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
