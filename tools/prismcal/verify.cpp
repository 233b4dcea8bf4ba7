// SPDX-License-Identifier: MIT
#include "tools/prismcal/verify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <tuple>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "drivers/capture_file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::verification {
namespace {

namespace fs = std::filesystem;
using recordings::LogFolder, recordings::LogSegment, recordings::SegmentEnd;

// Returns true for the first bytes of a log, also if a power failure truncated them, or if one of them is damaged. An
// empty or truncated *.csv is a log: prismd was stopped before its first row.
bool begins_a_log(const std::string& path) {
  constexpr std::string_view kFirstWords = "# prism ", kFormatMark = " data log, format ";
  auto in = FileReader::open(path);
  std::string first(64, '\0');
  first.resize(in ? in->read(first) : 0);
  const bool begins = kFirstWords.starts_with(first) || first.starts_with(kFirstWords);
  return in && (begins || first.find(kFormatMark) != std::string::npos);
}

// Also by the name, so that a capture with damaged first bytes is a fault, not a file of another type.
bool should_be_capture(const std::string& path) {
  return path.ends_with(".pcap") || path.ends_with(".pcapng") || recordings::is_capture(path);
}

/// Text of `error` without `path`: "what", or "LINE: what" if it has a line.
std::string without_path(const Error& error, const std::string& path) {
  std::string text = error.text();
  if (!text.starts_with(path + ":")) return text;
  return text.substr(text.find_first_not_of(' ', path.size() + 1));
}

/// A segment that was read. Of a capture, `position.log` is its name, and `position.first` is 1.
struct NumberedSegment {
  std::string path;
  pipeline::LogPosition position;
  std::uint64_t rows = 0;
  std::int64_t begin_s = 0;  ///< 0: not known
};

/// Adds findings for segments that are missing, and for segments with fewer rows than the next one says. `has_older`:
/// the folder has some of 0.3 or older, too, which are before them.
void check_numbers(const std::string& folder, bool has_older, std::vector<NumberedSegment> segments,
                   std::vector<Finding>& findings) {
  const auto key = [](const NumberedSegment& one) {
    return std::tie(one.position.log, one.position.segment, one.path);
  };
  std::sort(segments.begin(), segments.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
  const NumberedSegment* last = nullptr;
  for (const NumberedSegment& next : segments) {
    const pipeline::LogPosition& at = next.position;
    if (last == nullptr || last->position.log != at.log) {
      const recordings::Absent absent{at.segment - 1, at.first - 1, next.begin_s};
      if (absent.segments > 0 && !has_older) findings.push_back({folder, FileState::kDeleted, absent.text()});
    } else if (at.segment > last->position.segment) {  // else a copy
      const std::uint64_t files = at.segment - last->position.segment - 1, end = last->position.first + last->rows;
      const std::uint64_t rows = std::max(at.first, end) - end;
      if (files > 0)
        findings.push_back(
            {last->path, FileState::kMissing,
             "the next " + counted(files, "segment") + (rows > 0 ? ", with " + counted(rows, "row") : "")});
      else if (rows > 0)
        findings.push_back(
            {last->path, FileState::kMissing, fmt::format("{} of {}", rows, counted(last->rows + rows, "row"))});
    }
    last = &next;
  }
}

Finding of_segment(const LogSegment& segment) {
  const std::string rows = fmt::format("{}, format {}", counted(segment.rows, "row"), segment.format);
  if (segment.end == SegmentEnd::kOpen) return {segment.path, FileState::kOpen, rows + "; prismd writes it"};
  if (segment.end == SegmentEnd::kChanged)
    return {segment.path, FileState::kChanged, rows + "; differs from its end line, or has bytes after it"};
  if (segment.end == SegmentEnd::kIntact)
    return {segment.path, segment.damaged.empty() ? FileState::kIntact : FileState::kDamaged, rows};
  const std::string cut = segment.truncated_bytes == 0
                              ? ""
                              : fmt::format("; {} of an incomplete row from line {} on",
                                            counted(segment.truncated_bytes, "byte"), segment.truncated_line);
  return {segment.path, FileState::kTruncated, rows + ", no end" + cut};
}

// Adds one finding for consecutive rows that are left out for the same reason.
void add_left_out(const std::vector<recordings::LeftOutRow>& rows, std::vector<Finding>& findings) {
  for (std::size_t i = 0, end = 0; i < rows.size(); i = end) {
    while (end < rows.size() && rows[end].path == rows[i].path && rows[end].why == rows[i].why) ++end;
    const bool superseded = rows[i].why == recordings::kRepeatedLater;
    const std::string range = fmt::format("{} rows, to line {}: ", end - i, rows[end - 1].line);
    findings.push_back({rows[i].path, superseded ? FileState::kSuperseded : FileState::kDuplicate,
                        (end - i > 1 ? range : "") + rows[i].why, rows[i].line});
  }
}

/// Reads the rows of one axis and adds its sessions. Returns what is left out.
recordings::LeftOut read_axis(LogFolder& folder, const std::string& log, const std::string& axis,
                              std::vector<LogSession>& sessions) {
  std::int64_t last = 0;
  const auto add = [&](const recordings::LogRow& row, bool begins_session) -> Result<void> {
    const compensation::SecondMean& second_mean = row.second_mean;
    if (begins_session) {
      sessions.push_back({.log = log, .axis = axis, .first_s = second_mean.second + 1});
      last = second_mean.second - 1;
    }
    LogSession& session = sessions.back();
    session.last_s = second_mean.second + 1;
    ++session.rows;
    session.partial += second_mean.partial;
    session.missing_frames += second_mean.missing_frames;
    if (second_mean.second != last + 1) {
      session.gaps.push_back({last + 2, second_mean.second});
      session.missing_s += static_cast<std::uint64_t>(second_mean.second - last - 1);
    }
    last = second_mean.second;
    return {};
  };
  auto left_out = recordings::join_rows(folder, add);
  return left_out ? std::move(*left_out) : recordings::LeftOut();  // never an error: a failed disk is damage here
}

/// Checks the log in `folder`; with `only`, in that file of it.
void check_log(const std::string& where, const std::string& only, VerificationResult& result) {
  const std::string& path = only.empty() ? where : only;
  const auto folder = LogFolder::salvage(path);
  std::vector<LogFolder> axes = folder.by_axis();
  std::vector<Finding> left_out;
  std::map<std::string, const LogSegment*> read;
  for (LogFolder& axis : axes) {
    const std::string name = axes.size() > 1 ? axis.segments.front().value("axis") : "";
    add_left_out(read_axis(axis, path, name, result.sessions).rows, left_out);
    for (const LogSegment& segment : axis.segments) read[segment.path] = &segment;
  }
  const auto is_deleted = [&](const std::string& file) {  // meanwhile, by the retention limit
    std::error_code error;
    return only.empty() && !fs::exists(file, error);
  };
  std::map<std::string, std::uint64_t> rows;
  std::vector<NumberedSegment> numbered;
  for (const LogSegment& opened : folder.segments) {
    const LogSegment& segment = *read.at(opened.path);
    if (segment.read_failed && is_deleted(segment.path)) continue;
    rows[segment.file] = segment.rows + segment.damaged.size();
    if (segment.position)
      numbered.push_back({segment.path, *segment.position, rows[segment.file], segment.first_second.value_or(-1) + 1});
    result.findings.push_back(of_segment(segment));
    for (const auto& row : segment.damaged)
      result.findings.push_back({row.path, FileState::kDamaged, row.why, row.line});
  }
  for (const auto& [file, error] : folder.rejected)
    if (!is_deleted(file)) result.findings.push_back({file, FileState::kUnreadable, without_path(error, file)});
  if (only.empty()) {
    const bool has_older = numbered.size() < rows.size();
    check_numbers(where, has_older, std::move(numbered), result.findings);
  }
  if (auto one = folder.of_one_gyro(path); !one)
    result.findings.push_back({path, FileState::kUnreadable, one.error().what});
  result.findings.insert(result.findings.end(), left_out.begin(), left_out.end());
}

Finding check_capture(const std::string& path) {
  const bool open = is_locked(path);  // checked before reading: a capture that ends meanwhile is read to its end
  auto reader = drivers::CaptureReader::open(path);
  if (!reader) return {path, FileState::kUnreadable, without_path(reader.error(), path)};
  std::size_t packets = 0, opened = 0, bytes = 0, sent = 0, others = 0, back = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  std::uint64_t good = 0;
  for (; const auto packet = reader->next(); ++packets) {
    const bool opens = packet->event == drivers::CaptureEvent::kOpened;
    if (packets == 0) first_ns = packet->time_ns;
    back += packets > 0 && !opens && packet->time_ns < last_ns;
    last_ns = packet->time_ns;
    good = reader->position_bytes();
    opened += opens;
    others += packet->event == drivers::CaptureEvent::kOther;
    if (packet->event == drivers::CaptureEvent::kData) bytes += packet->bytes.size();
    if (packet->event == drivers::CaptureEvent::kSent) sent += packet->bytes.size();
  }
  others += reader->foreign_packets();
  std::string text = fmt::format("{}, {} of the line, opened {}", counted(packets, "packet"), counted(bytes, "byte"),
                                 counted(opened, "time"));
  if (sent > 0) text += ", " + counted(sent, "byte") + " sent to the device";
  if (packets > 0) text += fmt::format(", {} to {}", utc_nano_text(first_ns), utc_nano_text(last_ns));
  if (back > 0) text += "; the time goes back " + counted(back, "time");
  if (others > 0) text += "; " + counted(others, "packet") + " of other programs";
  if (open) return {path, FileState::kOpen, text + "; prismd writes it"};
  const std::string places = reader->damaged_places().text();
  if (!places.empty()) text += "; " + places;
  if (!reader->tail_damage().empty())
    text += fmt::format("; {} bytes from byte {} on are not a complete packet ({})", reader->size_bytes() - good, good,
                        without_path({"", reader->tail_damage()}, path));
  return {path,
          !places.empty()                 ? FileState::kDamaged
          : reader->tail_damage().empty() ? FileState::kIntact
                                          : FileState::kTruncated,
          text};
}

/// Checks the numbers of the captures of a folder.
void check_capture_numbers(const std::string& folder, const std::vector<std::string>& captures,
                           std::vector<Finding>& findings) {
  std::vector<NumberedSegment> numbered;
  for (const std::string& path : captures) {
    const std::string file = fs::path(path).filename().string();
    std::size_t end = file.size();  // of the name, which has no number, begin and running time
    for (int i = 0; i < 3 && end != std::string::npos && end > 0; ++i) end = file.rfind('-', end - 1);
    const std::string name = end == std::string::npos ? "" : file.substr(0, end);
    const auto found = pipeline::SegmentName::parse(file, name, ".pcap");
    if (found && found->number > 0) numbered.push_back({path, {name, found->number, 1, 0}, 0, found->begin_s});
  }
  const bool has_older = numbered.size() < captures.size();
  check_numbers(folder, has_older, std::move(numbered), findings);
}

/// Checks the files of a folder, or `only` one of them. If one .csv is a log, or if there is an index, the folder is a
/// log and its other .csv files are faults: the log readers read all .csv.
void check_folder(const std::string& folder, const std::string& only, std::vector<std::string> files,
                  VerificationResult& result) {
  std::sort(files.begin(), files.end());
  std::vector<std::string> tables, captures, others;
  bool has_index = false;
  for (const std::string& file : files) {
    if (file.ends_with(".csv"))
      tables.push_back(file);
    else if (should_be_capture(file))
      captures.push_back(file);
    else if (file.ends_with(".csv.index"))
      has_index = true;
    else if (!file.ends_with(".pcap.index"))
      others.push_back(file);
  }
  if (has_index || std::any_of(tables.begin(), tables.end(), begins_a_log))
    check_log(folder, has_index ? "" : only, result);
  else
    others.insert(others.end(), tables.begin(), tables.end());
  for (const std::string& path : captures) result.findings.push_back(check_capture(path));
  if (only.empty()) check_capture_numbers(folder, captures, result.findings);
  for (const std::string& other : others)
    result.findings.push_back({other, FileState::kSkipped, "not a file of prism"});
}

}  // namespace

std::size_t VerificationResult::faults() const {
  const auto bad = [](const Finding& finding) { return is_fault(finding.state); };
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(), bad));
}

VerificationResult verify(const std::string& path) {
  VerificationResult result;
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    const fs::path parent = fs::path(path).parent_path();
    const std::string folder = parent.empty() ? "." : parent.string();
    if (FileReader::open(path))
      check_folder(folder, path, {path}, result);
    else
      check_log(folder, path, result);  // which has the reason
  } else {                              // with the folders below it, without following links
    std::map<std::string, std::vector<std::string>> files;
    const auto options = fs::directory_options::skip_permission_denied;
    for (fs::recursive_directory_iterator entry(path, options, error), end; !error && entry != end;
         entry.increment(error)) {
      std::error_code unknown;
      if (entry->is_regular_file(unknown))
        files[entry->path().parent_path().string()].push_back(entry->path().string());
    }
    for (auto& [below, paths] : files) check_folder(below, "", std::move(paths), result);
  }
  const auto& findings = result.findings;
  if (std::all_of(findings.begin(), findings.end(), [](const Finding& f) { return f.state == FileState::kSkipped; }))
    result.findings.push_back(
        {path, FileState::kUnreadable,
         "found no log or capture; prismd --check checks models, frame descriptions and configurations"});
  return result;
}

}  // namespace prism::verification

namespace prism::commands {
namespace {

using nlohmann::ordered_json;
using verification::FileState;
using verification::Finding;
using verification::LogSession;
using verification::VerificationResult;

struct VerifyChoice {
  std::vector<std::string> paths;
  bool json = false;
};

std::string position(const std::string& path, std::size_t line) {
  return line > 0 ? fmt::format("{}:{}", path, line) : path;
}

const char* word(FileState state) { return verification::kStateNames[static_cast<std::size_t>(state)]; }

void print_session(const LogSession& session) {
  constexpr std::size_t kMaxGaps = 10;
  const std::string missing =
      session.missing_s == 0 && session.missing_frames == 0
          ? "complete"
          : fmt::format("missing: {} s in {}, {}", session.missing_s, counted(session.gaps.size(), "gap"),
                        counted(session.missing_frames, "frame"));
  fmt::print("{}: {}session {} to {}: {}, {} of them partial; {}\n", session.log,
             session.axis.empty() ? "" : "axis " + session.axis + ", ", utc_text(session.first_s),
             utc_text(session.last_s), counted(session.rows, "row"), session.partial, missing);
  for (std::size_t i = 0; i < std::min(kMaxGaps, session.gaps.size()); ++i) {
    const verification::Gap& gap = session.gaps[i];
    fmt::print("  no row: {} s, {} to {}\n", gap.last_s - gap.first_s + 1, utc_text(gap.first_s), utc_text(gap.last_s));
  }
  if (session.gaps.size() > kMaxGaps)
    fmt::print("  and {} more gaps (--json lists all)\n", session.gaps.size() - kMaxGaps);
}

void print(const VerificationResult& result) {
  std::size_t skipped = 0;
  for (const Finding& finding : result.findings) {
    skipped += finding.state == FileState::kSkipped;
    if (finding.state != FileState::kSkipped)
      fmt::print("{}: {}: {}\n", position(finding.path, finding.line), word(finding.state), finding.text);
  }
  for (const LogSession& session : result.sessions) print_session(session);
  const auto good = static_cast<std::size_t>(std::count_if(
      result.findings.begin(), result.findings.end(),
      [](const Finding& finding) { return finding.state == FileState::kIntact || finding.state == FileState::kOpen; }));
  fmt::print("faults: {}; intact files: {}; other files: {}\n", result.faults(), good, skipped);
}

ordered_json json_of(const VerificationResult& result) {
  ordered_json findings = ordered_json::array(), sessions = ordered_json::array();
  for (const Finding& finding : result.findings) {
    ordered_json json = {{"path", finding.path}, {"state", word(finding.state)}, {"text", finding.text}};
    if (finding.line > 0) json["line"] = finding.line;
    json["fault"] = verification::is_fault(finding.state);
    findings.push_back(std::move(json));
  }
  for (const LogSession& session : result.sessions) {
    ordered_json gaps = ordered_json::array();
    for (const auto& gap : session.gaps) gaps.push_back({{"first_s", gap.first_s}, {"last_s", gap.last_s}});
    sessions.push_back({{"log", session.log},
                        {"axis", session.axis.empty() ? ordered_json() : ordered_json(session.axis)},
                        {"first_s", session.first_s},
                        {"last_s", session.last_s},
                        {"rows", session.rows},
                        {"partial", session.partial},
                        {"missing_s", session.missing_s},
                        {"missing_frames", session.missing_frames},
                        {"holes", std::move(gaps)}});
  }
  return {{"faults", result.faults()}, {"findings", std::move(findings)}, {"sessions", std::move(sessions)}};
}

int run(const VerifyChoice& choice) {
  VerificationResult result;
  for (const std::string& path : choice.paths) {
    VerificationResult one = verification::verify(path);
    std::move(one.findings.begin(), one.findings.end(), std::back_inserter(result.findings));
    std::move(one.sessions.begin(), one.sessions.end(), std::back_inserter(result.sessions));
  }
  if (!choice.json) print(result);
  if (choice.json) fmt::print("{}\n", json_text(json_of(result), 2));
  return result.faults() == 0 ? 0 : 1;
}

}  // namespace

void add_verify_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("verify", "check logs and captures for damage");
  const auto choice = std::make_shared<VerifyChoice>();
  add_options(*command, {{"path", &choice->paths, "logs and captures; or folders"}}, Need::kRequired);
  add_options(*command, {{"--json", &choice->json, "print JSON"}});
  tools::add_examples(*command, {"prismcal verify /var/log/prismd/gyro1"});
  command->callback([choice, &code] { code = run(*choice); });
}

}  // namespace prism::commands
