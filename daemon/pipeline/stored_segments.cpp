// SPDX-License-Identifier: MIT
#include "daemon/pipeline/stored_segments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <vector>

#include "base/file.hpp"
#include "base/json_member.hpp"
#include "base/text_number.hpp"

namespace prism::pipeline {
namespace {

using nlohmann::json;

constexpr std::int64_t kMaxClockStep_s = 86'400;  // between two lines of an index; a larger step is damage

// The complete text and the groups of a pattern that matches it; empty if it does not match. Numbers in patterns have
// at most 15 digits, so that their sums do not overflow.
std::vector<std::string> groups_of(std::string_view text, const std::regex& pattern) {
  std::cmatch found;
  if (!std::regex_match(text.data(), text.data() + text.size(), found, pattern)) return {};
  return {found.begin(), found.end()};
}

// 0 for a group without digits.
std::uint64_t number_of(const std::string& digits) { return parse_number<std::uint64_t>(digits).value_or(0); }

std::int64_t seconds_of(const json& object, const char* key) {
  return static_cast<std::int64_t>(count_member(object, key));
}

// Clocks increase with the numbers: a smaller one is damage and makes no segment older than the one before it.
void take_made(OldIndex& index, const json& line, std::uint64_t number) {
  const auto next = index.entries.lower_bound(number);
  const std::int64_t least = next == index.entries.begin() ? 0 : std::prev(next)->second.clock_s;
  const std::int64_t clock_s = line.contains("clock_s") ? seconds_of(line, "clock_s") : index.clock_s;
  index.entries[number] = {text_member(line, "file"), count_member(line, "rows"),
                           std::clamp(clock_s, least, std::max(least, index.clock_s))};
  index.next = std::max(index.next, number + 1);
}

void take_line(OldIndex& index, const json& line) {
  if (!line.is_object()) return;
  if (text_member(line, "format") == "prism-segments" && count_member(line, "version") == 1) {
    index.id = text_member(line, "id");
    index.next = std::max<std::uint64_t>(count_member(line, "next"), 1);
    index.deleted_rows = count_member(line, "deleted_rows");
    index.clock_s = std::clamp<std::int64_t>(seconds_of(line, "clock_s"), 0, INT32_MAX);
    return;
  }
  const bool has_clock = line.contains("clock_s");
  if (has_clock)
    index.clock_s += std::clamp<std::int64_t>(seconds_of(line, "clock_s") - index.clock_s, 0, kMaxClockStep_s);
  if (const std::uint64_t made = count_member(line, "made"); made > 0) return take_made(index, line, made);
  const std::uint64_t deleted = count_member(line, "deleted");
  const auto entry =
      index.entries.find(std::max({count_member(line, "ended"), count_member(line, "deleting"), deleted}));
  if (entry == index.entries.end()) return;
  entry->second.rows = count_member(line, "rows");
  if (has_clock) entry->second.clock_s = index.clock_s;
  if (deleted == 0) return;
  index.deleted_rows += entry->second.rows;
  index.entries.erase(entry);
}

}  // namespace

std::string RowCursor::text() const { return fmt::format("{}-{}-{}-{}", log, segment, row, total); }

std::optional<RowCursor> RowCursor::parse(std::string_view text) {
  static const std::regex kCursor("([0-9a-f]{32})-([0-9]{1,15})-([0-9]{1,15})-([0-9]{1,15})");
  const auto part = groups_of(text, kCursor);
  if (part.empty()) return std::nullopt;
  return RowCursor{part[1], number_of(part[2]), number_of(part[3]), number_of(part[4])};
}

std::string SegmentName::file(const std::string& name, const std::string& extension) const {
  const std::string running = extension == ".pcap" ? fmt::format("-{}s", running_s) : "";
  return fmt::format("{}-{:06}-{}{}{}", name, number, utc_file_text(begin_s), running, extension);
}

std::optional<SegmentName> SegmentName::parse(std::string_view file, std::string_view name,
                                              std::string_view extension) {
  static const std::regex kNew("-([0-9]{6,15})-([0-9]{8}T[0-9]{6}Z)(?:-([0-9]{1,15})s)?");
  static const std::regex kOld("-([0-9]{8}T[0-9]{6}Z)(?:-([0-9]{1,15}))?");
  if (!file.starts_with(name)) return std::nullopt;
  file.remove_prefix(name.size());
  if (!file.ends_with(extension)) return std::nullopt;
  file.remove_suffix(extension.size());
  SegmentName found;
  std::optional<std::int64_t> begin_s;
  if (const auto part = groups_of(file, kNew); !part.empty()) {
    begin_s = parse_utc_file_text(part[2]);
    found.number = number_of(part[1]);
    found.running_s = static_cast<std::int64_t>(number_of(part[3]));
    if (found.number == 0 || part[3].empty() == (extension == ".pcap")) return std::nullopt;
  } else if (const auto old = groups_of(file, kOld); !old.empty()) {
    begin_s = parse_utc_file_text(old[1]);
    if (!old[2].empty()) found.same = number_of(old[2]);
  }
  found.begin_s = begin_s.value_or(0);
  return begin_s ? std::optional(found) : std::nullopt;
}

std::string LogPosition::line() const {
  return fmt::format("# log: {} segment {} first {} running {}\n", log, segment, first, running_s);
}

std::optional<LogPosition> LogPosition::parse(std::string_view value) {
  static const std::regex kPosition("([0-9a-f]{32}) segment ([0-9]{1,15}) first ([0-9]{1,15}) running ([0-9]{1,15})");
  const auto part = groups_of(value, kPosition);
  if (part.empty()) return std::nullopt;
  const LogPosition found{part[1], number_of(part[2]), number_of(part[3]),
                          static_cast<std::int64_t>(number_of(part[4]))};
  return found.segment > 0 && found.first > 0 ? std::optional(found) : std::nullopt;
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

}  // namespace prism::pipeline
