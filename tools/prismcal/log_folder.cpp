// SPDX-License-Identifier: MIT
#include "tools/prismcal/log_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {
namespace {

namespace fs = std::filesystem;
using pipeline::OldIndex;

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
  const auto entry = segment.add(line);
  if (!entry) return {};
  const auto& [key, value] = *entry;
  const bool is_absent = key == "axis" && value == "-";  // version 0.1
  if (auto good = check_text(rule_of(key), value, fmt::format("{}: {}", where, key)); !good && !is_absent) return good;
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

std::string_view without_cr(std::string_view line) {
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

/// The line of columns, with the lines above it. Errors: another format, not the columns of a log.
Result<void> read_columns(std::string_view line, const std::string& where, LogSegment& segment,
                          const std::string& column) {
  if (segment.format > kNewestFormat || segment.format < 1)
    return make_error(segment.path, fmt::format("found format {} of a newer prism, expected 1 or 2", segment.format));
  const std::vector<SensorName> sensors = compensation::sensors_in(segment.comments);
  auto layout = compensation::CsvLayout::parse(line, where, std::make_shared<const std::vector<SensorName>>(sensors));
  if (!layout) return tl::unexpected<Error>(layout.error());
  segment.session = segment.value("session");
  if (auto good = take_line(segment, "supersedes", "FILE from row N", segment.superseded); !good) return good;
  if (auto good = take_line(segment, "log", "ID segment N first ROW running S", segment.position); !good) return good;
  if (!column.empty()) {
    const auto names = tables::list_items(line);
    const auto found = std::ranges::find(names, column);
    if (found == names.end())
      return make_error(where,
                        fmt::format("found no column \"{}\", expected one of {}", column, fmt::join(names, ", ")));
    segment.requested = static_cast<std::size_t>(found - names.begin());
  }
  segment.columns = std::move(*layout);
  segment.columns->use_second_means(segment.requested);
  return {};
}

/// `memory` is that of the row before. Errors, with an empty place: a field that is not valid.
Result<void> parse_row(std::string_view line, const LogSegment& segment, compensation::CompensatedWindow& memory,
                       LogRow& row) {
  if (auto good = compensation::read_csv(line, {}, *segment.columns, memory); !good) return good;
  row.second_mean = memory.window.second_mean;
  if (!segment.requested) return {};
  const double* const real = segment.columns->real(*segment.requested, memory);
  const auto fields = real ? std::vector<std::string>() : tables::list_items(line);
  const std::string field = *segment.requested < fields.size() ? fields[*segment.requested] : "";
  const auto value = real ? *real : field.empty() ? std::optional(kUnknown) : parse_number<double>(field);
  if (!value) return make_error("", fmt::format("found \"{}\", expected a number", field));
  row.value = *value;
  return {};
}

// Version 0.1 wrote "-" if there was no axis.
std::string axis_of(const LogSegment& segment) {
  std::string axis = segment.value("axis");
  return axis == "-" ? "" : axis;
}

std::uint64_t size_of(const LogSegment& segment) {
  std::error_code error;
  return fs::file_size(segment.path, error);
}

using Beginning = std::tuple<std::int64_t, std::uint64_t, std::string>;  ///< first second, size and first lines

bool are_equal(const LogSegment& segment, const LogSegment& other) {
  const std::string sum = sha256_of_file(segment.path).value_or("");
  return !sum.empty() && sum == sha256_of_file(other.path).value_or("");
}

/// Opens all segments and sorts them: by the number of their position, or of the index next to them.
LogFolder opened(const std::string& path, const std::string& column) {
  LogFolder folder;
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  for (const std::string& file : is_folder ? files_of(path, ".csv") : std::vector{path}) {
    auto segment = open_log_segment(file, column);
    if (segment)
      folder.segments.push_back(std::move(*segment));
    else
      folder.rejected.emplace_back(file, std::move(segment.error()));
  }
  std::map<std::string, std::uint64_t> numbers;
  for (const LogSegment& segment : folder.segments) {  // a copy of another name has the number of its original
    if (segment.position && segment.file.find(fmt::format("-{:06}-", segment.position->segment)) != std::string::npos)
      numbers[segment.file] = segment.position->segment;
  }
  for (const std::string& file : is_folder ? files_of(path, ".csv.index") : std::vector<std::string>()) {
    for (const auto& [number, entry] : OldIndex::read(file).value_or(OldIndex()).entries)
      numbers.try_emplace(entry.file, number);
  }
  const auto sort_key = [&](const LogSegment& segment) {
    const auto own = numbers.find(segment.file);
    const std::uint64_t number = own != numbers.end() ? own->second : segment.position ? segment.position->segment : 0;
    // "NAME-20261121T091100Z-10.csv" after "…Z-2.csv".
    return std::tuple(number, own == numbers.end(), segment.format, segment.session,
                      segment.first_second.value_or(INT64_MIN), segment.file.size(), segment.file);
  };
  std::ranges::sort(folder.segments, {}, sort_key);
  return folder;
}

// One line per file that cannot be read, and per file with damaged rows: the first of them.
std::vector<std::string> damage_lines(const LogFolder& folder) {
  std::vector<std::string> lines;
  for (const auto& [file, error] : folder.rejected) lines.push_back(error.text() + "; file not used");
  for (const LogSegment& segment : folder.segments) {
    if (segment.damaged.empty()) continue;
    const LeftOutRow& row = segment.damaged.front();
    lines.push_back(
        fmt::format("{}:{}: {}; {} not used", row.path, row.line, row.why, counted(segment.damaged.size(), "row")));
  }
  return lines;
}

// Of each log, as its oldest segment says: the first in order.
std::vector<std::string> absent_texts(const std::vector<LogSegment>& segments) {
  std::set<std::string> logs;
  std::vector<std::string> texts;
  for (const LogSegment& segment : segments) {
    if (!segment.position || !logs.insert(segment.position->log).second) continue;
    std::string text =
        absent_text(segment.position->segment - 1, segment.position->first - 1, segment.first_second.value_or(-1) + 1);
    if (!text.empty()) texts.push_back(std::move(text));
  }
  return texts;
}

}  // namespace

bool begins_a_log(const std::string& path) {
  auto in = FileReader::open(path);
  std::string first(64, '\0');
  first.resize(in ? in->read(first) : 0);
  return in &&
         (kFirstWords.starts_with(first.substr(0, kFirstWords.size())) || first.find(kFormatMark) != std::string::npos);
}

bool is_log(const std::string& path) {
  if (!begins_a_log(path)) return false;
  auto in = FileReader::open(path);
  std::string line;
  while (in && in->read_line(line) && line.starts_with('#')) continue;
  return compensation::CsvLayout::parse(without_cr(line), path).has_value();
}

Result<LogSegment> open_log_segment(const std::string& path, const std::string& column) {
  LogSegment segment;
  segment.path = path;
  segment.file = fs::path(path).filename().string();
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::string first(kFirstWords.size(), '\0'), line, columns;
  first.resize(in->read(first));
  in->seek(0);
  std::size_t number = 0;
  const auto next = [&] { return in->read_line(line) && in->line_ended(); };
  while (columns.empty() && next()) {
    const std::string_view text = without_cr(line);
    if (++number == 1) segment.format = format_of(text);
    if (!text.empty() && text.front() != '#') columns = text;
    if (text.empty() || text.front() != '#') continue;
    if (auto added = add_comment(text, fmt::format("{}:{}", path, number), segment); !added)
      return tl::unexpected<Error>(added.error());
  }
  if (columns.empty() && kFirstWords.starts_with(first)) return segment;
  if (auto good = read_columns(columns, fmt::format("{}:{}", path, number), segment, column); !good)
    return tl::unexpected<Error>(good.error());
  compensation::CompensatedWindow memory;
  for (LogRow row; !segment.first_second && next() && !line.starts_with(kEndMark);) {
    const std::string_view text = without_cr(line);
    if (!text.empty() && text.front() != '#' && parse_row(text, segment, memory, row))
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
  Sha256 hash;
  std::string bytes;
  std::uint64_t good = 0;                // end of the last good line
  std::size_t lines = 0, good_line = 0;  // so far; number of that line
  std::size_t number = 0;                // rows so far, also damaged ones
  std::vector<LeftOutRow> unreadable;    // damage if a good line follows, else the incomplete end
  bool in_head = true, ended = !segment.columns;
  compensation::CompensatedWindow memory;
  LogRow row;
  for (; in->read_line(bytes); hash.add(bytes), hash.add(in->line_ended() ? "\n" : "")) {
    if (ended || !in->line_ended()) continue;
    ++lines;
    const std::string_view line = without_cr(bytes);
    const bool is_text = !line.empty() && line.front() != '#', is_row = is_text && !in_head;
    in_head = in_head && !is_text;
    row.line = lines;
    row.number = number += is_row;
    if (is_row) {
      if (auto parsed = parse_row(line, segment, memory, row); !parsed) {
        unreadable.push_back({segment.path, lines, std::move(parsed.error().what)});
        continue;
      }
    } else if (!in_head && line.starts_with(kEndMark)) {
      ended = true;
      const std::string end = fmt::format("rows {}, sha256 {}", number, hash.hex());
      segment.end = line.substr(kEndMark.size()) == end ? SegmentEnd::kIntact : SegmentEnd::kChanged;
    } else if (!unreadable.empty()) {
      continue;
    }
    std::move(unreadable.begin(), unreadable.end(), std::back_inserter(segment.damaged));
    unreadable.clear();
    good = in->offset();
    good_line = lines;
    if (!is_row) continue;
    ++segment.rows;
    if (!on_row) continue;
    if (auto done = on_row(row); !done) return done;
  }
  const bool endless = bytes.size() > kMaxLineBytes;  // zeros after a power failure
  segment.sha256 = endless ? sha256_of_file(segment.path).value_or("") : hash.hex();
  // After a read error of the disk, the rows before it are kept; the rest is damage.
  segment.read_failed = in->error() && !endless;
  if (segment.read_failed) segment.damaged.push_back({segment.path, good_line + 1, in->error()->what});
  segment.truncated_bytes = (endless ? size_of(segment) : in->offset()) - good;
  segment.truncated_line = segment.truncated_bytes > 0 ? good_line + 1 : 0;
  ended = ended && segment.columns;
  if (ended && (!segment.damaged.empty() || segment.truncated_bytes > 0)) segment.end = SegmentEnd::kChanged;
  if (!ended && (segment.format > 1 || segment.truncated_bytes > 0 || !segment.columns))
    segment.end = locked ? SegmentEnd::kOpen : SegmentEnd::kTruncated;
  return {};
}

std::vector<std::string> files_of(const std::string& folder, const std::string& extension) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().string().ends_with(extension)) paths.push_back(entry->path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

std::string absent_text(std::uint64_t segments, std::uint64_t rows, std::int64_t before_s) {
  if (segments == 0) return {};
  const std::string what = rows > 0 ? counted(rows, "row") : counted(segments, "segment");
  const std::string before = before_s == 0 ? "" : ", before " + utc_text(before_s);
  return fmt::format("begins with segment {}: {} of the log are not here{}", segments + 1, what, before);
}

Result<LogFolder> LogFolder::open(const std::string& path, const std::string& axis, const std::string& column) {
  LogFolder folder = opened(path, column);
  if (folder.segments.empty() && !folder.rejected.empty()) return tl::unexpected<Error>(folder.rejected.front().second);
  if (folder.segments.empty())
    return make_error(
        path, "found no .csv in the folder, expected prismd's log; give a capture by its own path, with --config");
  const std::vector<std::string> names = folder.axes();
  if (!axis.empty() || names.size() > 1) {
    const auto chosen = choose_axis(names, axis, path);
    if (!chosen) return tl::unexpected<Error>(chosen.error());
    std::erase_if(folder.segments, [&](const LogSegment& segment) { return axis_of(segment) != axis; });
  }
  if (auto one = folder.of_one_gyro(path); !one) return tl::unexpected<Error>(one.error());
  std::error_code error;
  if (fs::is_directory(path, error)) folder.absent = absent_texts(folder.segments);
  return folder;
}

Result<void> LogFolder::of_one_gyro(const std::string& path) const {
  for (const char* key : {"instance", "gyro_serial"}) {
    const LogSegment* first = nullptr;
    for (const LogSegment& segment : segments) {
      const std::string value = segment.value(key);
      if (value.empty() || value == "unknown") continue;
      if (first != nullptr && first->value(key) != value) {
        return make_error(path,
                          fmt::format("found logs of {} \"{}\" ({}) and \"{}\" ({}), expected one", key,
                                      plain_text(first->value(key)), first->file, plain_text(value), segment.file));
      }
      first = first != nullptr ? first : &segment;
    }
  }
  return {};
}

std::vector<std::string> LogFolder::axes() const {
  std::set<std::string> names;
  for (const LogSegment& segment : segments) names.insert(axis_of(segment));
  names.erase("");
  return {names.begin(), names.end()};
}

std::vector<LogFolder> LogFolder::by_axis() const {
  const std::vector<std::string> names = axes();
  std::map<std::string, LogFolder> parts;
  for (const LogSegment& segment : segments) {
    const std::string axis = axis_of(segment);
    parts[axis.empty() && names.size() == 1 ? names.front() : axis].segments.push_back(segment);
  }
  std::vector<LogFolder> folders;
  for (auto& [name, part] : parts) {
    part.salvaging = salvaging;
    folders.push_back(std::move(part));
  }
  return folders;
}

LogFolder LogFolder::salvage(const std::string& path) {
  LogFolder folder = opened(path, "");
  folder.salvaging = true;
  return folder;
}

std::vector<std::string> LeftOut::lines() const {
  std::vector<std::string> lines;
  const auto add = [&](std::uint64_t count, const char* what, const char* why) {
    if (count > 0) lines.push_back(counted(count, what) + why);
  };
  add(partial, "second", " not used: partial, at the start or end of a session");
  add(implausible, "second", " not used: implausible values");
  add(clocks_differ, "second", " not used: frames arrived at another rate than described (clocks_differ)");
  add(duplicates, "row", " left out: the second repeats or goes back in its session");
  add(copies, "file", " left out: identical to another one");
  add(superseded, "row", " left out: repeated in a later segment after a disk error");
  if (!truncated.empty())
    lines.push_back(
        fmt::format("{} without an end (copied while open, or prismd was killed): {}{}; {} of incomplete rows left out",
                    counted(truncated.size(), "segment"), truncated.front(), truncated.size() > 1 ? ", …" : "",
                    counted(truncated_bytes, "byte")));
  lines.insert(lines.end(), damaged.begin(), damaged.end());
  for (const std::string& file : changed)
    lines.push_back(fmt::format("{} was changed after it was written: it does not match its end line", file));
  return lines;
}

Result<LeftOut> join_rows(LogFolder& folder, const OnLogRow& on_row) {
  LeftOut left_out;
  std::map<std::string, std::uint64_t> superseded_from;
  for (const LogSegment& segment : folder.segments) {
    if (!segment.superseded) continue;
    std::uint64_t& from = superseded_from.try_emplace(segment.superseded->file, segment.superseded->row).first->second;
    from = std::min(from, segment.superseded->row);
  }
  std::map<Beginning, const LogSegment*> earlier;  // of which a segment may be a copy
  std::map<std::string, std::optional<std::int64_t>> last_seconds;
  std::optional<std::string> session;  // of the last row
  for (LogSegment& segment : folder.segments) {
    const auto leave_out = [&](std::size_t line, const char* why, std::uint64_t& count) {
      ++count;
      left_out.rows.push_back({segment.path, line, why});
      return Result<void>();
    };
    bool is_copy = false;
    if (segment.first_second) {
      const Beginning beginning{*segment.first_second, size_of(segment), segment.comments};
      const auto [other, is_first] = earlier.try_emplace(beginning, &segment);
      is_copy = !is_first && are_equal(segment, *other->second);
    }
    if (is_copy) leave_out(0, "identical to another file", left_out.copies);
    const auto superseded = superseded_from.find(segment.file);
    const std::uint64_t end = superseded == superseded_from.end() ? UINT64_MAX : superseded->second;
    std::optional<std::int64_t>& last = last_seconds[segment.session];
    const auto add = [&](const LogRow& row) -> Result<void> {
      if (is_copy) return {};
      const compensation::SecondMean& second_mean = row.second_mean;
      const bool goes_back = last && second_mean.second <= *last;
      if (row.number >= end) return leave_out(row.line, kRepeatedLater, left_out.superseded);
      if (goes_back && !segment.session.empty())
        return leave_out(row.line, "repeats a second or goes back in its session", left_out.duplicates);
      const bool begins = goes_back || session != segment.session;
      if (begins) session = segment.session;
      last = second_mean.second;
      left_out.partial += second_mean.partial;
      left_out.clocks_differ += !second_mean.partial && second_mean.clocks_differ;
      left_out.implausible += !second_mean.partial && second_mean.implausible.any();
      return on_row(row, begins);
    };
    if (auto done = read_log_segment(segment, add); !done) return tl::unexpected<Error>(done.error());
    if (segment.read_failed && !folder.salvaging)
      return make_error(fmt::format("{}:{}", segment.path, segment.damaged.back().line), segment.damaged.back().why);
    if (segment.end == SegmentEnd::kTruncated && !is_copy) {
      left_out.truncated.push_back(segment.file);
      left_out.truncated_bytes += segment.truncated_bytes;
    }
    if (segment.end == SegmentEnd::kChanged && segment.damaged.empty() && !is_copy)
      left_out.changed.push_back(segment.file);
  }
  left_out.damaged = damage_lines(folder);
  return left_out;
}

std::vector<std::string> axes_of_log(const std::string& path) { return LogFolder::salvage(path).axes(); }

Result<void> read_log(const std::string& path, const SourceOptions& options, SecondFeed& feed) {
  auto folder = LogFolder::open(path, options.axis);
  if (!folder) return tl::unexpected<Error>(folder.error());
  Recording& recording = feed.recording();
  recording.is_date = true;
  for (const LogSegment& segment : folder->segments)
    recording.metadata.insert(segment.metadata.begin(), segment.metadata.end());
  const auto left_out = join_rows(
      *folder, [&](const LogRow& row, bool begins_session) { return feed.push(row.second_mean, begins_session); });
  if (!left_out) return tl::unexpected<Error>(left_out.error());
  add_remarks(recording.findings, "file", left_out->lines());
  feed.finish();
  for (const LogSegment& segment : folder->segments)
    recording.files.push_back({segment.path, segment.sha256, segment.rows});
  add_remarks(recording.findings, "absent", folder->absent);
  return {};
}

}  // namespace prism::recordings
