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
#include "compensation/compensated_text.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::recordings {
namespace {

constexpr int kNewestFormat = 2;
constexpr std::string_view kFormatMark = " data log, format ";
constexpr std::string_view kFirstWords = "# prism ";
constexpr std::string_view kEndMark = "# end: ";

/// Iterates over the complete lines of a text; skips a last line without a line end.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  bool next() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) return false;
    begin_ = at_;
    line_ = text_.substr(at_, end - at_);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    at_ = end + 1;
    ++number_;
    return true;
  }
  std::string_view line() const { return line_; }
  std::size_t number() const { return number_; }
  std::size_t begin() const { return begin_; }    ///< position of the line in the text
  std::size_t next_begin() const { return at_; }  ///< position of the next line

 private:
  std::string_view text_, line_;
  std::size_t at_ = 0, begin_ = 0, number_ = 0;
};

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

// Parses "supersedes: FILE from row N".
bool parse_supersedes(LogSegment& segment) {
  const std::string text = segment.value("supersedes");
  if (text.empty()) return true;
  constexpr std::string_view kFrom = " from row ";
  const std::size_t at = text.rfind(kFrom);
  if (at == std::string::npos) return false;
  segment.supersedes_file = text.substr(0, at);
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data() + at + kFrom.size(), last, segment.supersedes_row);
  return error == std::errc() && end == last && segment.supersedes_row > 0;
}

/// Parses the rows of a segment.
class RowReader {
 public:
  RowReader(LogSegment& segment, compensation::CsvLayout layout, std::optional<std::size_t> column)
      : segment_(segment), layout_(std::move(layout)), column_(column) {}

  Result<void> add(std::string_view line, std::size_t line_number) {
    ++rows_;
    const std::string where = fmt::format("{}:{}", segment_.path, line_number);
    const auto row = compensation::parse_csv(line, where, layout_);
    if (!row) return tl::unexpected<Error>(row.error());
    LogRow log_row{row->window.second_mean, kUnknown, line_number, rows_};
    if (column_) {
      const std::string_view field = csv_field(line, ',', *column_).value_or("");
      const auto value = field.empty() ? std::optional(kUnknown) : csv_number(field);
      if (!value) return make_error(where, fmt::format("found \"{}\", expected a number", field));
      log_row.value = *value;
    }
    segment_.rows.push_back(std::move(log_row));
    return {};
  }

  std::size_t rows() const { return rows_; }  ///< counts damaged rows

 private:
  LogSegment& segment_;
  compensation::CsvLayout layout_;
  std::optional<std::size_t> column_;
  std::size_t rows_ = 0;
};

// Returns false if the text ends before the column line.
Result<bool> read_metadata(Lines& lines, LogSegment& segment) {
  while (lines.next()) {
    if (lines.number() == 1) segment.format = format_of(lines.line());
    if (lines.line().empty()) continue;
    if (lines.line().front() != '#') return true;
    auto added = add_comment(lines.line(), fmt::format("{}:{}", segment.path, lines.number()), segment);
    if (!added) return tl::unexpected(added.error());
  }
  return false;
}

Result<RowReader> read_columns(const Lines& lines, LogSegment& segment, const std::string& column) {
  const std::string& path = segment.path;
  if (segment.format > kNewestFormat || segment.format < 1)
    return make_error(path, fmt::format("found format {} of a newer prism, expected 1 or 2", segment.format));
  const std::string where = fmt::format("{}:{}", path, lines.number());
  const std::vector<SensorName> sensors = compensation::sensors_in(segment.comments);
  auto layout =
      compensation::CsvLayout::parse(lines.line(), where, std::make_shared<const std::vector<SensorName>>(sensors));
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.session = segment.value("session");
  if (!parse_supersedes(segment))
    return make_error(path,
                      fmt::format("supersedes: found \"{}\", expected FILE from row N", segment.value("supersedes")));
  std::optional<std::size_t> index;
  if (!column.empty()) {
    const auto names = csv_fields(lines.line(), ',');
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end())
      return make_error(where,
                        fmt::format("found no column \"{}\", expected one of {}", column, fmt::join(names, ", ")));
    index = static_cast<std::size_t>(found - names.begin());
  }
  return RowReader(segment, std::move(*layout), index);
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

Result<LogSegment> read_log_segment(const std::string& path, const std::string& column) {
  LogSegment segment;
  segment.path = path;
  segment.file = std::filesystem::path(path).filename().string();
  const bool open = is_locked(path);  // checked before reading: a segment that ends meanwhile is read with its end
  const auto available = read_available(path, kMaxTableBytes);
  if (!available) return tl::unexpected<Error>(available.error());
  const std::string* const text = &available->text;
  segment.sha256 = sha256_hex(*text);
  Lines lines(*text);
  const auto complete = read_metadata(lines, segment);
  if (!complete) return tl::unexpected<Error>(complete.error());
  if (!*complete && (text->starts_with(kFirstWords) || kFirstWords.starts_with(*text))) {
    segment.end = open ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
    segment.truncated_bytes = text->size();
    segment.truncated_line = 1;
    return segment;
  }
  auto rows = read_columns(lines, segment, column);
  if (!rows) return tl::unexpected<Error>(rows.error());
  std::size_t good = lines.next_begin(), good_lines = lines.number();
  std::optional<std::string> end;
  std::vector<LeftOutRow> unreadable;  // damage if a row or the end follows, else the truncated end
  while (!end && lines.next()) {
    if (lines.line().starts_with(kEndMark)) {
      end = fmt::format("rows {}, sha256 {}", rows->rows(), sha256_hex(text->substr(0, lines.begin())));
      segment.end = lines.line().substr(kEndMark.size()) == *end ? SegmentEnd::kIntact : SegmentEnd::kChanged;
    } else if (!lines.line().empty() && lines.line().front() != '#') {
      if (auto added = rows->add(lines.line(), lines.number()); !added) {
        unreadable.push_back({path, lines.number(), added.error().what});
        continue;
      }
    } else if (!unreadable.empty()) {
      continue;
    }
    segment.damaged.insert(segment.damaged.end(), unreadable.begin(), unreadable.end());
    unreadable.clear();
    good = lines.next_begin();
    good_lines = lines.number();
  }
  // After a read error of the disk, the rows before it are kept; the rest is damage.
  if (available->error) segment.damaged.push_back({path, good_lines + 1, available->error->what});
  segment.read_failed = available->error.has_value();
  if (end && (!segment.damaged.empty() || lines.next_begin() < text->size())) segment.end = SegmentEnd::kChanged;
  segment.truncated_bytes = text->size() - good;
  segment.truncated_line = segment.truncated_bytes > 0 ? good_lines + 1 : 0;
  if (!end && (segment.format > 1 || segment.truncated_bytes > 0))
    segment.end = open ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
  return segment;
}

Result<std::string> rewritten(const LogSegment& segment, const std::vector<std::size_t>& kept,
                              const std::string& remark) {
  const auto text = read_available(segment.path, kMaxTableBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  std::string copy;
  Lines lines(text->text);
  for (bool columns = false; lines.next();) {
    const std::string_view line = lines.line();
    const bool is_comment = line.starts_with('#');
    if (line.empty() || line.starts_with(kEndMark)) continue;
    if (columns && !is_comment && !std::binary_search(kept.begin(), kept.end(), lines.number())) continue;
    columns = columns || !is_comment;
    copy.append(line).append("\n");
    if (lines.number() == 1) copy += fmt::format("# repaired: {}\n", remark);
  }
  if (segment.format > 1) copy += fmt::format("{}rows {}, sha256 {}\n", kEndMark, kept.size(), sha256_hex(copy));
  return copy;
}

}  // namespace prism::recordings
