// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/log_segment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/log_lines.hpp"

namespace prism::recordings {
namespace {

constexpr int kNewestFormat = 2;
constexpr std::string_view kFormatMark = " data log, format ";
constexpr std::string_view kFirstWords = "# prism ";

int format_of(std::string_view line) {
  const std::size_t at = line.find(kFormatMark);
  int format = 1;
  if (at == std::string_view::npos) return format;
  const std::string_view number = line.substr(at + kFormatMark.size());
  std::from_chars(number.data(), number.data() + number.size(), format);
  return format;
}

TextRule rule_of(std::string_view key) {
  if (key == "axis") return TextRule::kAxisName;
  if (key == "instance") return TextRule::kName;
  if (key == "gyro_serial") return TextRule::kText;
  return TextRule::kLongText;
}

/// Adds a header line to the metadata. Errors: unprintable text, or a name that breaks its rule.
Result<void> add_comment(std::string_view line, const std::string& where, LogSegment& segment) {
  if (auto good = check_text(TextRule::kLongText, line, where); !good) return good;
  segment.comments += std::string(line) + '\n';
  const std::size_t colon = line.find(": ");
  if (!line.starts_with("# ") || colon == std::string_view::npos) return {};
  const std::string_view key = line.substr(2, colon - 2), value = line.substr(colon + 2);
  const bool is_absent = key == "axis" && value == "-";  // version 0.1
  if (auto good = check_text(rule_of(key), value, fmt::format("{}: {}", where, key)); !good && !is_absent) return good;
  segment.metadata.emplace(key, value);
  if (key != "sensors") return {};
  for (const SensorName& sensor : compensation::sensors_in(std::string(line) + '\n')) {
    if (auto good = check_text(TextRule::kSensorName, sensor.name, fmt::format("{}: {}", where, key)); !good)
      return good;
  }
  return {};
}

/// Reads a header line "# KEY: VALUE", if the segment has it.
template <class Value>
Result<void> take_line(const LogSegment& segment, const char* key, const char* expected, std::optional<Value>& value) {
  const std::string text = segment.value(key);
  if (!text.empty()) value = Value::parse(text);
  if (text.empty() || value) return {};
  return make_error(segment.path, fmt::format("{}: found \"{}\", expected {}", key, text, expected));
}

// Returns false if the text ends before the column line.
Result<bool> read_metadata(LogLines& lines, LogSegment& segment) {
  while (lines.next()) {
    if (lines.number() == 1) segment.format = format_of(lines.line());
    if (lines.line().empty()) continue;
    if (lines.line().front() != '#') return true;
    auto added = add_comment(lines.line(), fmt::format("{}:{}", segment.path, lines.number()), segment);
    if (!added) return tl::unexpected(added.error());
  }
  return false;
}

/// The bytes of a log up to its line of columns; all bytes if it has none.
std::string head_of(FileReader& in) {
  constexpr std::size_t kPiece = 1u << 14;
  std::string text, piece(kPiece, '\0');
  std::size_t searched = 0;
  while (const std::size_t got = in.read(piece)) {
    text.append(piece, 0, got);
    for (std::size_t end; (end = text.find('\n', searched)) != std::string::npos; searched = end + 1) {
      const std::string_view line = std::string_view(text).substr(searched, end - searched);
      if (!line.empty() && line != "\r" && line.front() != '#') return text.substr(0, end + 1);
    }
  }
  return text;
}

Result<LogRowLayout> read_columns(const LogLines& lines, LogSegment& segment, const std::string& column) {
  const std::string& path = segment.path;
  if (segment.format > kNewestFormat || segment.format < 1)
    return make_error(path, fmt::format("found format {} of a newer prism, expected 1 or 2", segment.format));
  const std::string where = fmt::format("{}:{}", path, lines.number());
  const std::vector<SensorName> sensors = compensation::sensors_in(segment.comments);
  auto layout =
      compensation::CsvLayout::parse(lines.line(), where, std::make_shared<const std::vector<SensorName>>(sensors));
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.session = segment.value("session");
  if (auto good = take_line(segment, "supersedes", "FILE from row N", segment.superseded); !good)
    return tl::unexpected<Error>(good.error());
  if (auto good = take_line(segment, "log", "ID segment N first ROW running S", segment.position); !good)
    return tl::unexpected<Error>(good.error());
  std::optional<std::size_t> index;
  if (!column.empty()) {
    const auto names = csv_fields(lines.line(), ',');
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end())
      return make_error(where,
                        fmt::format("found no column \"{}\", expected one of {}", column, fmt::join(names, ", ")));
    index = static_cast<std::size_t>(found - names.begin());
  }
  layout->use_second_means(index);
  return LogRowLayout{std::move(*layout), index, lines.next_begin(), lines.number()};
}

}  // namespace

std::string LogSegment::value(const std::string& key) const {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

bool is_log(const std::string& path) {
  auto in = FileReader::open(path);
  std::string line;
  if (!in || !in->read_line(line)) return false;
  if (!line.starts_with(kFirstWords) || line.find(kFormatMark) == std::string::npos) return false;
  while (in->read_line(line) && line.starts_with('#')) continue;
  if (line.ends_with('\r')) line.pop_back();
  return compensation::CsvLayout::parse(line, path).has_value();
}

Result<LogSegment> open_log_segment(const std::string& path, const std::string& column) {
  LogSegment segment;
  segment.path = path;
  segment.file = std::filesystem::path(path).filename().string();
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  const std::string text = head_of(*in);
  LogLines lines(text);
  const auto complete = read_metadata(lines, segment);
  if (!complete) return tl::unexpected<Error>(complete.error());
  if (!*complete && (text.starts_with(kFirstWords) || kFirstWords.starts_with(text))) return segment;
  auto layout = read_columns(lines, segment, column);
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.layout = std::make_shared<const LogRowLayout>(std::move(*layout));
  in->seek(segment.layout->head_bytes);
  LogRowParser parser(*segment.layout);
  for (std::string line; !segment.first_second && in->read_line(line) && in->line_ended();) {
    if (line.starts_with(kLogEndMark)) break;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with('#')) continue;
    if (parser.parse(line)) segment.first_second = parser.second_mean().second;
  }
  return segment;
}

}  // namespace prism::recordings
