// SPDX-License-Identifier: MIT
// verify: checks logs and captures: intact, truncated, changed, damaged, duplicate, missing or unreadable.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
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
#include "tools/prismcal/recording.hpp"

namespace prism::commands {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using recordings::LogFolder, recordings::LogSegment, recordings::SegmentEnd;

/// The state of a file, or of rows of it. Printed names do not change.
struct State {
  const char* name;
  bool fault = true;
};
constexpr State kIntact{"whole", false};
constexpr State kOpen{"open", false};              // prismd still writes it (flock)
constexpr State kSuperseded{"superseded", false};  // rows repeated in a later segment after a disk error
constexpr State kDeleted{"deleted", false};        // segments before the oldest one of a log or capture
constexpr State kTruncated{"torn"};                // no end, or an incomplete last row or packet
constexpr State kChanged{"changed"};               // differs from its end line, or has damaged rows or bytes after it
constexpr State kDamaged{"damaged"};               // an unreadable row, or part of a capture
constexpr State kDuplicate{"doubled"};             // repeats a second or goes back, or a file another one
constexpr State kMissing{"missing"};               // the log or capture had them: files, or rows of one
constexpr State kUnreadable{"refused"};            // cannot be read, or has other contents than its name implies

void add(ordered_json& result, const std::string& path, const State& state, const std::string& text,
         std::size_t line = 0) {
  ordered_json finding = {{"path", path}, {"state", state.name}, {"text", text}};
  if (line > 0) finding["line"] = line;
  finding["fault"] = state.fault;
  result["findings"].push_back(std::move(finding));
  if (state.fault) result["faults"] = result["faults"].get<std::size_t>() + 1;
}

/// Text of `error` without `path`: "what", or "LINE: what" if it has a line.
std::string without_path(const Error& error, const std::string& path) {
  const std::string text = error.text();
  return text.starts_with(path + ":") ? text.substr(text.find_first_not_of(' ', path.size() + 1)) : text;
}

/// Segments in order: by the log's id or the capture's name, their number and path. `first`: see LogPosition.
struct Numbered {
  std::uint64_t first = 1, rows = 0;
  std::int64_t begin_s = 0;  ///< 0: not known
};
using NumberedSegments = std::map<std::tuple<std::string, std::uint64_t, std::string>, Numbered>;

/// Adds findings for segments that are missing, and for segments with fewer rows than the next one says. `has_older`:
/// the folder has some of 0.3 or older, too, which are before them.
void check_numbers(const std::string& folder, bool has_older, const NumberedSegments& segments, ordered_json& result) {
  std::string last_log, last_path;
  std::uint64_t last = 0, rows = 0, end = 0;  // number of the last segment, its rows, the first row after it
  for (const auto& [key, next] : segments) {
    const auto& [log, number, path] = key;
    if (last == 0 || last_log != log) {
      const std::string absent = recordings::absent_text(number - 1, next.first - 1, next.begin_s);
      if (!absent.empty() && !has_older) add(result, folder, kDeleted, absent);
    } else if (number > last) {  // else a copy
      const std::uint64_t files = number - last - 1, missing = std::max(next.first, end) - end;
      const std::string with = missing > 0 ? ", with " + counted(missing, "row") : "";
      if (files > 0)
        add(result, last_path, kMissing, "the next " + counted(files, "segment") + with);
      else if (missing > 0)
        add(result, last_path, kMissing, fmt::format("{} of {}", missing, counted(rows + missing, "row")));
    }
    last_log = log, last_path = path, last = number, rows = next.rows, end = next.first + next.rows;
  }
}

void add_segment(const LogSegment& segment, ordered_json& result) {
  std::string text = fmt::format("{}, format {}", counted(segment.rows, "row"), segment.format);
  const State* state = segment.damaged.empty() ? &kIntact : &kDamaged;
  if (segment.end == SegmentEnd::kOpen) {
    state = &kOpen, text += "; prismd writes it";
  } else if (segment.end == SegmentEnd::kChanged) {
    state = &kChanged, text += "; differs from its end line, or has bytes after it";
  } else if (segment.end == SegmentEnd::kTruncated) {
    state = &kTruncated, text += ", no end";
    if (segment.truncated_bytes > 0)
      text += fmt::format("; {} of an incomplete row from line {} on", counted(segment.truncated_bytes, "byte"),
                          segment.truncated_line);
  }
  add(result, segment.path, *state, text);
  for (const auto& row : segment.damaged) add(result, row.path, kDamaged, row.why, row.line);
}

// Adds one finding for consecutive rows that are left out for the same reason.
void add_left_out(const std::vector<recordings::LeftOutRow>& rows, ordered_json& result) {
  for (std::size_t i = 0, end = 0; i < rows.size(); i = end) {
    while (end < rows.size() && rows[end].path == rows[i].path && rows[end].why == rows[i].why) ++end;
    const std::string range = fmt::format("{} rows, to line {}: ", end - i, rows[end - 1].line);
    add(result, rows[i].path, rows[i].why == recordings::kRepeatedLater ? kSuperseded : kDuplicate,
        (end - i > 1 ? range : "") + rows[i].why, rows[i].line);
  }
}

/// A session of a log so far.
struct Session {
  std::int64_t first_s = 0, last_s = 0;
  std::size_t rows = 0, partial = 0;
  std::uint64_t missing_s = 0, missing_frames = 0;
  ordered_json holes = ordered_json::array();

  void add(const compensation::SecondMean& second_mean) {
    const std::int64_t end_s = second_mean.second + 1;
    if (rows++ == 0) first_s = end_s, last_s = end_s - 1;
    partial += second_mean.partial;
    missing_frames += second_mean.missing_frames;
    missing_s += static_cast<std::uint64_t>(end_s - last_s - 1);
    if (end_s != last_s + 1) holes.push_back({{"first_s", last_s + 1}, {"last_s", end_s - 1}});
    last_s = end_s;
  }
};

/// Reads the rows of one axis and adds its sessions. Returns what is left out.
recordings::LeftOut read_axis(LogFolder& folder, const std::string& log, const std::string& axis,
                              ordered_json& sessions) {
  Session session;
  const auto end_session = [&] {
    if (session.rows == 0) return;
    sessions.push_back({{"log", log},
                        {"axis", axis.empty() ? ordered_json() : ordered_json(axis)},
                        {"first_s", session.first_s},
                        {"last_s", session.last_s},
                        {"rows", session.rows},
                        {"partial", session.partial},
                        {"missing_s", session.missing_s},
                        {"missing_frames", session.missing_frames},
                        {"holes", std::move(session.holes)}});
    session = {};
  };
  auto left_out = recordings::join_rows(folder, [&](const recordings::LogRow& row, bool begins_session) {
    if (begins_session) end_session();
    session.add(row.second_mean);
    return Result<void>();
  });
  end_session();
  return left_out ? std::move(*left_out) : recordings::LeftOut();  // never an error: a failed disk is damage here
}

/// Checks a log: a folder, or one file of it.
void check_log(const std::string& path, bool is_folder, ordered_json& result) {
  const auto folder = LogFolder::salvage(path);
  const auto is_deleted = [&](const std::string& file) {  // meanwhile, by the retention limit
    std::error_code error;
    return is_folder && !fs::exists(file, error);
  };
  NumberedSegments numbered;
  bool has_older = false;
  std::vector<LogFolder> axes = folder.by_axis();
  for (LogFolder& axis : axes) {
    const std::string name = axes.size() > 1 ? axis.segments.front().value("axis") : "";
    const recordings::LeftOut left_out = read_axis(axis, path, name, result["sessions"]);
    for (const LogSegment& segment : axis.segments) {
      if (segment.read_failed && is_deleted(segment.path)) continue;
      add_segment(segment, result);
      has_older = has_older || !segment.position;
      if (const auto& at = segment.position)
        numbered[{at->log, at->segment, segment.path}] = {at->first, segment.rows + segment.damaged.size(),
                                                          segment.first_second.value_or(-1) + 1};
    }
    add_left_out(left_out.rows, result);
  }
  for (const auto& [file, error] : folder.rejected)
    if (!is_deleted(file)) add(result, file, kUnreadable, without_path(error, file));
  if (is_folder) check_numbers(path, has_older, numbered, result);
  if (auto one = folder.of_one_gyro(path); !one) add(result, path, kUnreadable, one.error().what);
}

void check_capture(const std::string& path, ordered_json& result) {
  const bool open = is_locked(path);  // checked before reading: a capture that ends meanwhile is read to its end
  auto reader = drivers::CaptureReader::open(path);
  if (!reader) return add(result, path, kUnreadable, without_path(reader.error(), path));
  std::size_t packets = 0, opened = 0, bytes = 0, sent = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  std::uint64_t good = 0;
  for (; const auto packet = reader->next(); ++packets) {
    if (packets == 0) first_ns = packet->time_ns;
    last_ns = packet->time_ns;
    good = reader->position_bytes();
    opened += packet->event == drivers::CaptureEvent::kOpened;
    if (packet->event == drivers::CaptureEvent::kData) bytes += packet->bytes.size();
    if (packet->event == drivers::CaptureEvent::kSent) sent += packet->bytes.size();
  }
  std::string text = fmt::format("{}, {} of the line, opened {}", counted(packets, "packet"), counted(bytes, "byte"),
                                 counted(opened, "time"));
  if (sent > 0) text += ", " + counted(sent, "byte") + " sent to the device";
  if (packets > 0) text += fmt::format(", {} to {}", utc_nano_text(first_ns), utc_nano_text(last_ns));
  if (open) return add(result, path, kOpen, text + "; prismd writes it");
  const std::string places = reader->damaged_places().text(), tail = reader->tail_damage();
  if (!places.empty()) text += "; " + places;
  if (!tail.empty())
    text += fmt::format("; {} bytes from byte {} on are not a complete packet ({})", reader->size_bytes() - good, good,
                        without_path({"", tail}, path));
  add(result, path, !places.empty() ? kDamaged : tail.empty() ? kIntact : kTruncated, text);
}

/// Adds a capture by its name, which ends with its number, begin and running time; returns false if it has none.
bool add_number(const std::string& path, NumberedSegments& captures) {
  const std::string file = fs::path(path).filename().string();
  std::size_t end = file.size();
  for (int i = 0; i < 3 && end != std::string::npos && end > 0; ++i) end = file.rfind('-', end - 1);
  const std::string name = end == std::string::npos ? "" : file.substr(0, end);
  const auto found = pipeline::SegmentName::parse(file, name, ".pcap");
  if (found && found->number > 0) captures[{name, found->number, path}] = {1, 0, found->begin_s};
  return found && found->number > 0;
}

/// Checks the files of `where`, a folder, or the only one. If one .csv is a log, all of a folder are: its readers read
/// them.
void check_files(const std::string& where, const std::set<std::string>& files, bool is_folder, ordered_json& result) {
  const auto is_log_file = [](const std::string& file) {
    return file.ends_with(".csv") && recordings::begins_a_log(file);
  };
  if (std::ranges::any_of(files, is_log_file)) check_log(where, is_folder, result);
  NumberedSegments captures;
  bool has_older = false;
  for (const std::string& file : files) {
    // Also by the name, so that a capture with damaged first bytes is a fault, not a file of another type.
    if (!file.ends_with(".pcap") && !file.ends_with(".pcapng") && !recordings::is_capture(file)) continue;
    check_capture(file, result);
    has_older = !add_number(file, captures) || has_older;
  }
  if (is_folder) check_numbers(where, has_older, captures, result);
}

}  // namespace

ordered_json verify(const std::vector<std::string>& paths) {
  ordered_json result = {{"faults", 0}, {"findings", ordered_json::array()}, {"sessions", ordered_json::array()}};
  for (const std::string& path : paths) {
    const std::size_t before = result["findings"].size();
    std::error_code error;
    const auto file = FileReader::open(path);
    const bool is_folder = fs::is_directory(path, error);
    std::map<std::string, std::set<std::string>> folders;  // with those below, without following links
    const auto options = fs::directory_options::skip_permission_denied;
    for (fs::recursive_directory_iterator entry(path, options, error), end; !error && entry != end;
         entry.increment(error)) {
      std::error_code unknown;
      if (entry->is_regular_file(unknown)) folders[entry->path().parent_path().string()].insert(entry->path().string());
    }
    for (const auto& [folder, files] : folders) check_files(folder, files, true, result);
    if (file && !is_folder) check_files(path, {path}, false, result);
    if (result["findings"].size() == before)
      add(result, path, kUnreadable,
          file || is_folder
              ? "found no log or capture; prismd --check checks models, frame descriptions and configurations"
              : file.error().what);
  }
  return result;
}

namespace {

std::string text_of(const ordered_json& object, const char* key) { return object[key].get<std::string>(); }

void print_findings(const ordered_json& result) {
  std::size_t intact = 0;
  for (const ordered_json& finding : result["findings"]) {
    const std::size_t line = finding.value("line", std::size_t{0});
    const std::string state = text_of(finding, "state");
    fmt::print("{}{}: {}: {}\n", text_of(finding, "path"), line > 0 ? fmt::format(":{}", line) : "", state,
               text_of(finding, "text"));
    intact += state == "whole" || state == "open";
  }
  for (const ordered_json& session : result["sessions"]) {
    const auto number = [&](const char* key) { return session[key].get<std::size_t>(); };
    const auto time = [](const ordered_json& second) { return utc_text(second.get<std::int64_t>()); };
    fmt::print("{}: {}session {} to {}: {}, {} of them partial; missing: {} s in {}, {}\n", text_of(session, "log"),
               session["axis"].is_null() ? "" : "axis " + text_of(session, "axis") + ", ", time(session["first_s"]),
               time(session["last_s"]), counted(number("rows"), "row"), number("partial"), number("missing_s"),
               counted(session["holes"].size(), "gap"), counted(number("missing_frames"), "frame"));
    for (std::size_t i = 0; i < std::min<std::size_t>(10, session["holes"].size()); ++i) {  // --json has all
      const ordered_json& hole = session["holes"][i];
      const auto first_s = hole["first_s"].get<std::int64_t>(), last_s = hole["last_s"].get<std::int64_t>();
      fmt::print("  no row: {} s, {} to {}\n", last_s - first_s + 1, utc_text(first_s), utc_text(last_s));
    }
  }
  fmt::print("faults: {}; intact files: {}\n", result["faults"].get<std::size_t>(), intact);
}

}  // namespace

void add_verify_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("verify", "check logs and captures for damage");
  const auto paths = std::make_shared<std::vector<std::string>>();
  const auto json = std::make_shared<bool>();
  add_options(*command, {{"path", paths.get(), "logs and captures; or folders"}}, Need::kRequired);
  add_options(*command, {{"--json", json.get(), "print JSON"}});
  tools::add_examples(*command, {"prismcal verify /var/log/prismd/gyro1"});
  command->callback([paths, json, &code] {
    const ordered_json result = verify(*paths);
    if (*json)
      fmt::print("{}\n", json_text(result, 2));
    else
      print_findings(result);
    code = result["faults"] == 0 ? 0 : 1;
  });
}

}  // namespace prism::commands
