// SPDX-License-Identifier: MIT
#include "tools/prismcal/log_segment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "compensation/compensated_text.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {

struct LogRowLayout {
  compensation::CsvLayout columns;
  std::optional<std::size_t> column;  ///< index of the requested column
  std::size_t head_lines = 0;         ///< up to the line of columns
};

namespace {

constexpr int kNewestFormat = 2;
constexpr std::string_view kEndMark = "# end: ";
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

/// The complete lines of a file with their places, and the hash of its bytes.
class Lines {
 public:
  explicit Lines(FileReader in) : in_(std::move(in)) {}

  /// Returns false at the end, or if only a part of a line is left.
  bool next() {
    std::size_t end = 0;
    for (std::size_t searched = next_; (end = bytes_.find('\n', searched)) == std::string::npos;) {
      searched = bytes_.size() - next_;
      if (!fill()) return false;
    }
    begin_ = std::exchange(next_, end + 1);
    ++number_;
    return true;
  }
  /// Valid until the next call of next().
  std::string_view line() const {
    if (next_ == begin_) return {};  // before the first line
    const std::string_view line = std::string_view(bytes_).substr(begin_, next_ - 1 - begin_);
    return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
  }
  std::size_t number() const { return number_; }                    ///< of the line, from 1
  std::size_t next_begin() const { return dropped_ + next_; }       ///< offset of the next line in the file
  std::size_t bytes() const { return dropped_ + bytes_.size(); }    ///< that were read
  std::string sha256_before() { return hash_until(begin_).hex(); }  ///< of all bytes before the line
  std::string sha256() { return hash_until(bytes_.size()).hex(); }  ///< of all that were read
  const std::optional<Error>& error() const { return in_.error(); }
  /// Reads the rest of the file.
  void finish() {
    while (fill()) next_ = bytes_.size();
  }

 private:
  /// Drops the bytes before the next line, and reads more.
  bool fill() {
    constexpr std::size_t kPiece = 1u << 18;
    hash_until(next_);
    bytes_.erase(0, next_);
    dropped_ += next_;
    next_ = hashed_ = begin_ = 0;
    const std::size_t filled = bytes_.size();
    bytes_.resize(filled + kPiece);
    const std::size_t got = in_.read(std::span(bytes_).subspan(filled));
    bytes_.resize(filled + got);
    return got > 0;
  }
  const Sha256& hash_until(std::size_t end) {
    hash_.add(std::string_view(bytes_).substr(hashed_, end - hashed_));
    hashed_ = end;
    return hash_;
  }

  FileReader in_;
  std::string bytes_;
  std::size_t begin_ = 0, next_ = 0, hashed_ = 0;  ///< in bytes_: of the line, of the next one, hashed up to here
  std::size_t dropped_ = 0, number_ = 0;           ///< bytes of the file before bytes_
  Sha256 hash_;
};

// Returns false if the file ends before the column line.
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

Result<LogRowLayout> read_columns(const Lines& lines, LogSegment& segment, const std::string& column) {
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
    const auto names = tables::list_items(lines.line());
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end())
      return make_error(where,
                        fmt::format("found no column \"{}\", expected one of {}", column, fmt::join(names, ", ")));
    index = static_cast<std::size_t>(found - names.begin());
  }
  layout->use_second_means(index);
  return LogRowLayout{std::move(*layout), index, lines.number()};
}

/// Parses rows of one layout, one after the other, in the same memory.
class RowParser {
 public:
  /// `layout` must outlive the parser.
  explicit RowParser(const LogRowLayout& layout) : layout_(layout) {}

  /// Errors, with an empty place: a field that is not valid.
  Result<void> parse(std::string_view line, LogRow& row) {
    if (auto good = compensation::read_csv(line, {}, layout_.columns, row_); !good) return good;
    row.second_mean = row_.window.second_mean;
    if (!layout_.column) return {};
    const double* const real = layout_.columns.real(*layout_.column, row_);
    const auto fields = real ? std::vector<std::string>() : tables::list_items(line);
    const std::string field = *layout_.column < fields.size() ? fields[*layout_.column] : "";
    const auto value = real ? *real : field.empty() ? std::optional(kUnknown) : parse_number<double>(field);
    if (!value) return make_error("", fmt::format("found \"{}\", expected a number", field));
    row.value = *value;
    return {};
  }

 private:
  const LogRowLayout& layout_;
  compensation::CompensatedWindow row_;
};

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
  std::string first(kFirstWords.size(), '\0');
  first.resize(in->read(first));
  in->seek(0);
  Lines lines(std::move(*in));
  const auto complete = read_metadata(lines, segment);
  if (!complete) return tl::unexpected<Error>(complete.error());
  if (!*complete && kFirstWords.starts_with(first)) return segment;
  auto layout = read_columns(lines, segment, column);
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.layout = std::make_shared<const LogRowLayout>(std::move(*layout));
  RowParser parser(*segment.layout);
  for (LogRow row; !segment.first_second && lines.next() && !lines.line().starts_with(kEndMark);) {
    if (!lines.line().empty() && lines.line().front() != '#' && parser.parse(lines.line(), row))
      segment.first_second = row.second_mean.second;
  }
  return segment;
}

Result<void> read_log_segment(LogSegment& segment, const OnSegmentRow& on_row) {
  const bool locked = is_locked(segment.path);  // checked before reading: one that ends meanwhile is read to its end
  auto in = FileReader::open(segment.path);
  if (!in) {
    segment.damaged.push_back({segment.path, 0, in.error().what});
    segment.read_failed = true;
    return {};
  }
  Lines lines(std::move(*in));
  std::size_t number = 0;                // rows so far, also damaged ones
  std::size_t good = 0, good_lines = 0;  // end of the last good line
  std::vector<LeftOutRow> unreadable;    // damage if a good line follows, else the incomplete end
  bool ended = false;
  std::optional<RowParser> parser;
  if (segment.layout) parser.emplace(*segment.layout);
  LogRow row;
  while (parser && !ended && lines.next()) {
    const std::string_view line = lines.line();
    const bool in_head = lines.number() <= segment.layout->head_lines;
    const bool is_row = !in_head && !line.empty() && line.front() != '#';
    row.number = number += is_row;
    row.line = lines.number();
    if (is_row) {
      if (auto parsed = parser->parse(line, row); !parsed) {
        unreadable.push_back({segment.path, row.line, std::move(parsed.error().what)});
        continue;
      }
    } else if (!in_head && line.starts_with(kEndMark)) {
      ended = true;
      const std::string end = fmt::format("rows {}, sha256 {}", number, lines.sha256_before());
      segment.end = line.substr(kEndMark.size()) == end ? SegmentEnd::kIntact : SegmentEnd::kChanged;
    } else if (!unreadable.empty()) {
      continue;
    }
    std::move(unreadable.begin(), unreadable.end(), std::back_inserter(segment.damaged));
    unreadable.clear();
    good = lines.next_begin();
    good_lines = lines.number();
    if (!is_row) continue;
    ++segment.rows;
    if (!on_row) continue;
    if (auto done = on_row(row); !done) return done;
  }
  lines.finish();
  segment.sha256 = lines.sha256();
  // After a read error of the disk, the rows before it are kept; the rest is damage.
  if (lines.error()) segment.damaged.push_back({segment.path, good_lines + 1, lines.error()->what});
  segment.read_failed = lines.error().has_value();
  segment.truncated_bytes = lines.bytes() - good;
  segment.truncated_line = segment.truncated_bytes > 0 ? good_lines + 1 : 0;
  if (ended && (!segment.damaged.empty() || segment.truncated_bytes > 0)) segment.end = SegmentEnd::kChanged;
  if (!ended && (segment.format > 1 || segment.truncated_bytes > 0 || !segment.layout))
    segment.end = locked ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
  return {};
}

}  // namespace prism::recordings
