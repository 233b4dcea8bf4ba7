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
#include "tools/prismcal/recordings/file_lock.hpp"

namespace prism::recordings {
namespace {

constexpr int kNewestFormat = 2;
constexpr std::string_view kFormatMark = " data log, format ";
constexpr std::string_view kFirstWords = "# prism ";
constexpr std::string_view kEndMark = "# end: ";

/// Goes over the lines of a text; a last one without a line end is none.
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
  std::size_t begin() const { return begin_; }  ///< of the line, in the text
  std::size_t behind() const { return at_; }    ///< where the next line begins

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

/// A line of the header: printable, and names in it follow their rules.
Result<void> take_comment(std::string_view line, const std::string& place, LogSegment& segment) {
  if (auto good = check_text(TextRule::kLongText, line, place); !good) return good;
  segment.comments += std::string(line) + '\n';
  const std::size_t colon = line.find(": ");
  if (!line.starts_with("# ") || colon == std::string_view::npos) return {};
  const std::string_view key = line.substr(2, colon - 2), value = line.substr(colon + 2);
  const bool is_absent = key == "axis" && value == "-";  // version 0.1
  if (auto good = check_text(rule_of(key), value, fmt::format("{}: {}", place, key)); !good && !is_absent) return good;
  segment.metadata.emplace(key, value);
  if (key != "sensors") return {};
  for (const SensorName& sensor : compensation::sensors_in(std::string(line) + '\n')) {
    if (auto good = check_text(TextRule::kSensorName, sensor.name, fmt::format("{}: {}", place, key)); !good)
      return good;
  }
  return {};
}

// "FILE from row N"
bool take_superseded(LogSegment& segment) {
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

/// Reads the rows of one segment below its columns.
class RowReader {
 public:
  RowReader(LogSegment& segment, compensation::CsvLayout layout, std::optional<std::size_t> column)
      : segment_(segment), layout_(std::move(layout)), column_(column) {}

  Result<void> take(std::string_view line, std::size_t line_number) {
    ++rows_;
    const std::string place = fmt::format("{}:{}", segment_.path, line_number);
    const auto row = compensation::parse_csv(line, place, layout_);
    if (!row) return tl::unexpected<Error>(row.error());
    LogRow taken{row->window.second_mean, kUnknown, line_number, rows_};
    if (column_) {
      const std::string_view field = csv_field(line, ',', *column_).value_or("");
      const auto value = field.empty() ? std::optional(kUnknown) : csv_number(field);
      if (!value) return make_error(place, fmt::format("found \"{}\", expected a number", field));
      taken.value = *value;
    }
    segment_.rows.push_back(std::move(taken));
    return {};
  }

  std::size_t rows() const { return rows_; }  ///< damaged ones, too

 private:
  LogSegment& segment_;
  compensation::CsvLayout layout_;
  std::optional<std::size_t> column_;
  std::size_t rows_ = 0;
};

// False: the text ends before the columns.
Result<bool> read_metadata(Lines& lines, LogSegment& segment) {
  while (lines.next()) {
    if (lines.number() == 1) segment.format = format_of(lines.line());
    if (lines.line().empty()) continue;
    if (lines.line().front() != '#') return true;
    auto taken = take_comment(lines.line(), fmt::format("{}:{}", segment.path, lines.number()), segment);
    if (!taken) return tl::unexpected(taken.error());
  }
  return false;
}

Result<RowReader> read_columns(const Lines& lines, LogSegment& segment, const std::string& column) {
  const std::string& path = segment.path;
  if (segment.format > kNewestFormat || segment.format < 1)
    return make_error(path, fmt::format("found format {}, expected 1 or 2: made by a newer prism", segment.format));
  const std::string place = fmt::format("{}:{}", path, lines.number());
  const std::vector<SensorName> sensors = compensation::sensors_in(segment.comments);
  auto layout =
      compensation::CsvLayout::parse(lines.line(), place, std::make_shared<const std::vector<SensorName>>(sensors));
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.session = segment.value("session");
  if (!take_superseded(segment))
    return make_error(path,
                      fmt::format("supersedes: found \"{}\", expected FILE from row N", segment.value("supersedes")));
  std::optional<std::size_t> index;
  if (!column.empty()) {
    const auto names = csv_fields(lines.line(), ',');
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end())
      return make_error(place, fmt::format("no column \"{}\"; found {}", column, fmt::join(names, ", ")));
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
  const bool open = is_locked(path);  // before it is read: one that ends meanwhile is read with its end
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
  std::size_t good = lines.behind(), good_lines = lines.number();
  std::optional<std::string> end;
  std::vector<LeftOutRow> torn;  // unless a row or the end stands behind them: no power cut does that
  while (!end && lines.next()) {
    if (lines.line().starts_with(kEndMark)) {
      end = fmt::format("rows {}, sha256 {}", rows->rows(), sha256_hex(text->substr(0, lines.begin())));
      segment.end = lines.line().substr(kEndMark.size()) == *end ? SegmentEnd::kIntact : SegmentEnd::kChanged;
    } else if (!lines.line().empty() && lines.line().front() != '#') {
      if (auto taken = rows->take(lines.line(), lines.number()); !taken) {
        torn.push_back({path, lines.number(), taken.error().what});
        continue;
      }
    } else if (!torn.empty()) {
      continue;
    }
    segment.damaged.insert(segment.damaged.end(), torn.begin(), torn.end());
    torn.clear();
    good = lines.behind();
    good_lines = lines.number();
  }
  // The rows before a bad block of the disk are read; what follows them is damage.
  if (available->error) segment.damaged.push_back({path, good_lines + 1, available->error->what});
  if (end && (!segment.damaged.empty() || lines.behind() < text->size())) segment.end = SegmentEnd::kChanged;
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
