// SPDX-License-Identifier: MIT
#include "daemon/pipeline/stored_segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/file.hpp"
#include "base/text_number.hpp"

namespace prism::pipeline {
namespace {

using nlohmann::json;

constexpr std::size_t kStampChars = 16;           // 20261121T091100Z
constexpr std::size_t kMaxDigits = 15;            // of a number in a name, header or cursor: sums do not overflow
constexpr std::int64_t kMaxClockStep_s = 86'400;  // between two lines of an index; a larger step is damage

bool take(std::string_view& text, std::string_view word) {
  if (!text.starts_with(word)) return false;
  text.remove_prefix(word.size());
  return true;
}

std::optional<std::uint64_t> take_number(std::string_view& text) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  if (digits == 0 || digits > kMaxDigits) return std::nullopt;
  const auto number = parse_number<std::uint64_t>(text.substr(0, digits));
  text.remove_prefix(digits);
  return number;
}

// 0 or empty if it is missing or of another type.
template <class T>
T value_of(const json& object, const char* key) {
  const auto found = object.find(key);
  const T* const value = found == object.end() ? nullptr : found->get_ptr<const T*>();
  return value == nullptr ? T() : *value;
}
std::uint64_t unsigned_of(const json& object, const char* key) { return value_of<std::uint64_t>(object, key); }
std::int64_t seconds_of(const json& object, const char* key) { return value_of<std::int64_t>(object, key); }
std::string word_of(const json& object, const char* key) { return value_of<std::string>(object, key); }

// Clocks increase with the numbers: a smaller one is damage and makes no segment older than the one before it.
void take_made(OldIndex& index, const json& line, std::uint64_t number) {
  const auto next = index.entries.lower_bound(number);
  const std::int64_t least = next == index.entries.begin() ? 0 : std::prev(next)->second.clock_s;
  const std::int64_t clock_s = line.contains("clock_s") ? seconds_of(line, "clock_s") : index.clock_s;
  index.entries[number] = {word_of(line, "file"), unsigned_of(line, "rows"),
                           std::clamp(clock_s, least, std::max(least, index.clock_s))};
  index.next = std::max(index.next, number + 1);
}

void take_line(OldIndex& index, const json& line) {
  if (!line.is_object()) return;
  if (word_of(line, "format") == "prism-segments" && unsigned_of(line, "version") == 1) {
    index.id = word_of(line, "id");
    index.next = std::max<std::uint64_t>(unsigned_of(line, "next"), 1);
    index.deleted_segments = unsigned_of(line, "deleted_segments");
    index.deleted_rows = unsigned_of(line, "deleted_rows");
    index.deleted_before_s = seconds_of(line, "deleted_before_s");
    index.clock_s = std::clamp<std::int64_t>(seconds_of(line, "clock_s"), 0, INT32_MAX);
    return;
  }
  const bool has_clock = line.contains("clock_s");
  if (has_clock)
    index.clock_s += std::clamp<std::int64_t>(seconds_of(line, "clock_s") - index.clock_s, 0, kMaxClockStep_s);
  if (const std::uint64_t made = unsigned_of(line, "made"); made > 0) return take_made(index, line, made);
  const std::uint64_t deleted = unsigned_of(line, "deleted");
  const auto entry = index.entries.find(std::max({unsigned_of(line, "ended"), unsigned_of(line, "deleting"), deleted}));
  if (entry == index.entries.end()) return;
  entry->second.rows = unsigned_of(line, "rows");
  if (has_clock) entry->second.clock_s = index.clock_s;
  if (deleted == 0) return;
  ++index.deleted_segments;
  index.deleted_rows += entry->second.rows;
  if (const std::int64_t before_s = seconds_of(line, "before_s"); before_s != 0) index.deleted_before_s = before_s;
  index.entries.erase(entry);
}

}  // namespace

bool is_log_id(std::string_view text) {
  return text.size() == kLogIdChars &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

std::string RowCursor::text() const { return fmt::format("{}-{}-{}-{}", log, segment, row, total); }

std::optional<RowCursor> RowCursor::parse(std::string_view text) {
  if (!is_log_id(text.substr(0, kLogIdChars))) return std::nullopt;
  RowCursor cursor;
  cursor.log = text.substr(0, kLogIdChars);
  text.remove_prefix(kLogIdChars);
  for (std::uint64_t RowCursor::*const part : {&RowCursor::segment, &RowCursor::row, &RowCursor::total}) {
    const auto number = take(text, "-") ? take_number(text) : std::nullopt;
    if (!number) return std::nullopt;
    cursor.*part = *number;
  }
  return text.empty() ? std::optional(cursor) : std::nullopt;
}

std::string SegmentName::file(const std::string& name, const std::string& extension) const {
  const std::string running = extension == ".pcap" ? fmt::format("-{}s", running_s) : "";
  return fmt::format("{}-{:06}-{}{}{}", name, number, utc_file_text(begin_s), running, extension);
}

std::optional<SegmentName> SegmentName::parse(std::string_view file, std::string_view name,
                                              std::string_view extension) {
  if (!take(file, name) || !take(file, "-") || !file.ends_with(extension)) return std::nullopt;
  file.remove_suffix(extension.size());
  SegmentName found;
  const bool numbered = file.find('-') >= 6 && file.find('-') < kStampChars;
  if (numbered) {
    found.number = take_number(file).value_or(0);
    if (found.number == 0 || !take(file, "-")) return std::nullopt;
  }
  const auto begin_s = parse_utc_file_text(file.substr(0, kStampChars));
  if (!begin_s) return std::nullopt;
  found.begin_s = *begin_s;
  file.remove_prefix(kStampChars);
  if (numbered && extension == ".pcap") {
    if (!take(file, "-")) return std::nullopt;
    const auto running_s = take_number(file);
    if (!running_s || file != "s") return std::nullopt;
    found.running_s = static_cast<std::int64_t>(*running_s);
    return found;
  }
  if (!numbered && take(file, "-")) {
    const auto same = take_number(file);
    if (!same) return std::nullopt;
    found.same = *same;
  }
  return file.empty() ? std::optional(found) : std::nullopt;
}

std::string LogPosition::line() const {
  return fmt::format("# log: {} segment {} first {} running {}\n", log, segment, first, running_s);
}

std::optional<LogPosition> LogPosition::parse(std::string_view value) {
  LogPosition found;
  if (!is_log_id(value.substr(0, kLogIdChars))) return std::nullopt;
  found.log = value.substr(0, kLogIdChars);
  value.remove_prefix(kLogIdChars);
  const auto number = [&](std::string_view word) { return take(value, word) ? take_number(value) : std::nullopt; };
  const auto segment = number(" segment "), first = number(" first "), running_s = number(" running ");
  if (!segment || !first || !running_s || !value.empty() || *segment == 0 || *first == 0) return std::nullopt;
  found.segment = *segment;
  found.first = *first;
  found.running_s = static_cast<std::int64_t>(*running_s);
  return found;
}

std::optional<SupersededRows> SupersededRows::parse(std::string_view value) {
  constexpr std::string_view kBetween = " from row ";
  const std::size_t at = value.rfind(kBetween);
  if (at == std::string_view::npos || at == 0) return std::nullopt;
  const auto row = parse_number<std::uint64_t>(value.substr(at + kBetween.size()));
  if (!row || *row == 0) return std::nullopt;
  return SupersededRows{std::string(value.substr(0, at)), *row};
}

// The part before the last '\n': a power cut may have cut the last line.
std::optional<OldIndex> OldIndex::read(const std::string& path) {
  const Result<std::string> text = read_text_file(path, kMaxModelBytes);
  OldIndex index;
  if (!text) return std::nullopt;
  const std::size_t last = text->rfind('\n') + 1;
  for (std::size_t begin = 0; begin < last;) {
    const std::size_t end = text->find('\n', begin);
    take_line(index, json::parse(text->begin() + static_cast<std::ptrdiff_t>(begin),
                                 text->begin() + static_cast<std::ptrdiff_t>(end), nullptr, false));
    if (index.id.empty()) return std::nullopt;
    begin = end + 1;
  }
  return index.id.empty() ? std::nullopt : std::optional(index);
}

std::uint64_t OldIndex::number(const std::string& file) const {
  const auto found =
      std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.second.file == file; });
  return found == entries.end() ? 0 : found->first;
}

}  // namespace prism::pipeline
