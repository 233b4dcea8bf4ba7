// SPDX-License-Identifier: MIT
// Rows of the log: `prismctl rows` prints them from a cursor on, `prismctl export` copies those of a time span into
// files.
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "tools/client/client.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

namespace asio = boost::asio;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kWait_s = 5;  // less than Client::kTimeout
constexpr std::uint64_t kPage = 2000, kExportPage = 10'000;

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0, end = 0; end != line.size(); begin = end + 1) {
    end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
  }
  return fields;
}

ordered_json object_of(std::string_view columns, std::string_view line, ordered_json object) {
  const std::vector<std::string_view> names = fields_of(columns), fields = fields_of(line);
  for (std::size_t i = 0; i < std::min(names.size(), fields.size()); ++i) {
    ordered_json& value = object[std::string(names[i])];
    if (fields[i].empty()) continue;  // null
    value = parse_number<double>(fields[i]) ? ordered_json::parse(fields[i], nullptr, false) : ordered_json(fields[i]);
  }
  return object;
}

// A line of the log as it is; on a terminal as printable().
void print_log_line(std::string_view line) {
  static const bool terminal = ::isatty(STDOUT_FILENO) == 1;
  if (terminal) return fmt::print("{}\n", printable(line));
  fmt::print("{}\n", line);
}

class Follower {
 public:
  Follower(const std::string& socket, const RowsSettings& settings)
      : client_(io_, socket), settings_(settings), axis_(settings.axis), cursor_(settings.after) {
    client_.on_end = [this](client::State, const std::string& reason) { ended(reason); };
  }

  int run() {
    if (const auto begun = begin(); !begun) return fail(begun.error());
    asio::co_spawn(io_, client_.run([this] { return pages(); }, true), asio::detached);
    io_.run();
    if (!result_) return fail(result_.error());
    if (settings_.cursor_file.empty())
      fmt::print(stderr, "prismctl: {} rows; continue with --after {}\n", rows_, cursor_);
    return 0;
  }

 private:
  // A missing file means the first call.
  Result<void> begin() {
    if (settings_.cursor_file.empty()) return {};
    errno = 0;
    const auto kept = read_text_file(settings_.cursor_file);
    if (!kept && errno == ENOENT) return {};
    if (!kept) return tl::unexpected<Error>(kept.error());
    const std::string cursor = kept->substr(0, kept->find('\n'));
    if (!cursor.empty()) cursor_ = cursor;
    return check_text(TextRule::kText, cursor, settings_.cursor_file);
  }

  asio::awaitable<std::string> pages() {
    for (;;) {
      const std::uint64_t left = settings_.limit > 0 ? settings_.limit - rows_ : kPage;
      json params = {{"limit", std::min(left, kPage)}, {"wait_s", settings_.follow ? kWait_s : 0}};
      if (!cursor_.empty()) params["after"] = cursor_;
      if (!settings_.axis.empty()) params["axis"] = settings_.axis;
      const auto answer = co_await client_.ask("rows", params);
      if (!answer && is_temporary(answer.error().code)) co_return answer.error().error.what;
      if (answer && settings_.axis.empty()) {
        for (const auto& [only, own] : at(*answer, "axes").items()) axis_ = only;
      }
      const Result<bool> more =
          answer ? print(client::of_axis(*answer, settings_.axis)) : Result<bool>(tl::unexpect, answer.error().error);
      if (more && *more) continue;
      result_ = more.map([](bool) {});
      client_.close();
      co_return "";
    }
  }

  bool is_temporary(config::SocketError code) const {
    return code == config::kGone || (settings_.follow && (code == config::kTimeout || code == config::kBusy));
  }

  // Returns false at the end.
  Result<bool> print(const json& page) {
    retrying_ = false;
    if (const json& missing = at(page, "missing"); missing.is_number() && missing > 0)
      fmt::print(stderr, "prismctl: {} rows are missing here: deleted or damaged before they were fetched\n",
                 json_text(missing));
    for (const json& segment : at(page, "segments")) print_segment(segment);
    std::fflush(stdout);
    cursor_ = text_member(page, "after", cursor_);
    if (const auto stored = store_cursor(); !stored) return tl::unexpected<Error>(stored.error());
    const bool enough = settings_.limit > 0 && rows_ >= settings_.limit;
    return !enough && (settings_.follow || at(page, "more") == true);
  }

  void print_segment(const json& segment) {
    const std::string columns = text_member(segment, "columns");
    if (!settings_.json && columns != columns_) print_log_line(columns);
    columns_ = columns;
    std::uint64_t number = count_member(segment, "first");
    for (const json& row : at(segment, "rows")) {
      const std::string line = row.is_string() ? row.get<std::string>() : "";
      if (settings_.json)
        print_json(object_of(columns, line, {{"axis", axis_}, {"segment", at(segment, "segment")}, {"row", number}}));
      if (!settings_.json) print_log_line(line);
      ++rows_, ++number;
    }
  }

  Result<void> store_cursor() {
    if (auto valid = check_text(TextRule::kText, cursor_, "prismd: after"); !valid) return valid;
    if (settings_.cursor_file.empty()) return {};
    return write_text_file(settings_.cursor_file, cursor_ + "\n");
  }

  void ended(const std::string& reason) {
    const Error error{client_.socket(), reason};
    if (!settings_.follow) {
      result_ = tl::unexpected<Error>(error);
      client_.close();
    } else if (!std::exchange(retrying_, true)) {
      fmt::print(stderr, "prismctl: {}; retrying\n", error.text());
    }
  }

  asio::io_context io_;
  client::Client client_;
  RowsSettings settings_;
  std::string axis_;  ///< of the rows: the chosen one, or the only one
  std::string cursor_, columns_;
  std::uint64_t rows_ = 0;
  Result<void> result_;
  bool retrying_ = false;
};

/// "2026-11-23", "2026-11-23T09:11", "2026-11-23 09:11:00Z"
std::optional<std::int64_t> time_in(std::string text) {
  constexpr std::string_view kMidnight = "T000000Z";
  std::replace(text.begin(), text.end(), ' ', 'T');
  const auto dropped = [](char c) { return c == '-' || c == ':' || c == 'Z'; };
  text.erase(std::remove_if(text.begin(), text.end(), dropped), text.end());
  if (text.size() != 8 && text.size() != 13 && text.size() != 15) return std::nullopt;
  if (text.size() < 15) text += kMidnight.substr(text.size() - 8);
  return parse_utc_file_text(text.back() == 'Z' ? text : text + "Z");
}

class Export {
 public:
  explicit Export(const ExportSettings& settings) : settings_(settings) {}

  int run(const std::string& socket) {
    auto done = prepare();
    if (done) done = client::connected(socket, [this](client::Client& client) { return copy_all(client); });
    if (!done) return fail(done.error());
    std::string text = fmt::format("{}: {} rows in {} files", settings_.directory, rows_, files_);
    if (missing_ > 0) text += fmt::format("; {} rows are missing: deleted or damaged", missing_);
    fmt::print("{}\n", printable(text));
    return rows_ > 0 ? 0 : 1;
  }

 private:
  asio::awaitable<Result<void>> copy_all(client::Client& client) {
    if (!settings_.axis.empty()) co_return co_await copy(client, settings_.axis);
    const auto status = co_await client.ask("status");
    if (!status) co_return tl::unexpected<Error>(status.error().error);
    for (const auto& [axis, own] : at(*status, "axes").items()) {
      auto copied = co_await copy(client, axis);
      if (!copied) co_return copied;
    }
    co_return Result<void>();
  }

  asio::awaitable<Result<void>> copy(client::Client& client, std::string axis) {
    json params = {{"axis", axis}, {"after", "earliest"}, {"limit", kExportPage}, {"header", true}};
    for (bool more = true; more;) {
      const auto answer = co_await client.ask("rows", params);
      if (!answer) co_return tl::unexpected<Error>(answer.error().error);
      const json& page = client::of_axis(*answer, axis);
      for (const json& segment : at(page, "segments")) {
        if (auto done = add(segment); !done) co_return done;
      }
      if (const json& missing = at(page, "missing"); missing.is_number_unsigned())
        missing_ += missing.get<std::uint64_t>();
      params["after"] = text_member(page, "after");
      more = at(page, "more") == true;
    }
    co_return close();
  }

  static Result<double> time_of(const char* option, const std::string& text, double otherwise) {
    if (text.empty()) return otherwise;
    if (const auto time = time_in(text)) return static_cast<double>(*time);
    return make_error(option, fmt::format("found \"{}\", expected a time in UTC such as 2026-11-23T09:11:00", text));
  }

  Result<void> prepare() {
    const auto from = time_of("--from", settings_.from, -std::numeric_limits<double>::infinity());
    if (!from) return tl::unexpected<Error>(from.error());
    const auto to = time_of("--to", settings_.to, std::numeric_limits<double>::infinity());
    if (!to) return tl::unexpected<Error>(to.error());
    from_ = *from;
    to_ = *to;
    if (from_ >= to_) return make_error("--to", "is not after --from");
    if (::mkdir(settings_.directory.c_str(), 0777) != 0 && errno != EEXIST)
      return make_error(settings_.directory, std::strerror(errno));
    std::error_code error;
    if (!std::filesystem::is_empty(settings_.directory, error))
      return make_error(settings_.directory, error ? error.message() : "is not empty, expected a new directory");
    return {};
  }

  // Rows of a segment; the next page may have more of them.
  Result<void> add(const json& segment) {
    const std::string name = text_member(segment, "file"), columns = text_member(segment, "columns");
    if (name != name_) {
      if (auto done = close(); !done) return done;
      name_ = name;
    }
    const std::vector<std::string_view> names = fields_of(columns);
    const auto column = static_cast<std::size_t>(std::find(names.begin(), names.end(), "time_s") - names.begin());
    if (column == names.size()) return make_error(name, "found no column time_s");
    for (const json& row : at(segment, "rows")) {
      const std::string line = row.is_string() ? row.get<std::string>() : "";
      const std::vector<std::string_view> fields = fields_of(line);
      const auto time = column < fields.size() ? parse_number<double>(fields[column]) : std::nullopt;
      if (!time || *time < from_ || *time >= to_) continue;
      if (text_.empty()) {
        auto head = head_of(segment, columns);
        if (!head) return tl::unexpected<Error>(head.error());
        text_ = std::move(*head);
      }
      text_ += line + '\n';
      ++file_rows_;
    }
    return {};
  }

  // Without the line "supersedes": its rows of an earlier file were left out by prismd.
  Result<std::string> head_of(const json& segment, const std::string& columns) const {
    std::string head;
    const std::string header = text_member(segment, "header");
    for (std::string_view rest = header; !rest.empty();) {
      const std::size_t end = std::min(rest.find('\n'), rest.size() - 1) + 1;
      if (!rest.starts_with("# supersedes: ")) head += rest.substr(0, end);
      rest.remove_prefix(end);
    }
    if (head.empty()) return make_error(name_, "prismd sent no header; expected prismd 0.3 or later");
    if (name_.find('/') != std::string::npos || !check_text(TextRule::kName, name_, "file"))
      return make_error("prismd", fmt::format("found the file name {}", printable(name_)));
    return head + columns + '\n';
  }

  // Ends the file as prismd does (docs/formats.md).
  Result<void> close() {
    if (text_.empty()) return {};
    Sha256 sum;
    sum.add(text_);
    text_ += fmt::format("# end: rows {}, sha256 {}\n", file_rows_, sum.hex());
    rows_ += std::exchange(file_rows_, 0);
    ++files_;
    return write_text_file(settings_.directory + "/" + name_, std::exchange(text_, ""));
  }

  const ExportSettings& settings_;
  double from_ = 0, to_ = 0;
  std::string name_, text_;  ///< of the current file
  std::uint64_t file_rows_ = 0, rows_ = 0, files_ = 0, missing_ = 0;
};

}  // namespace

int rows(const std::string& socket, const RowsSettings& settings) { return Follower(socket, settings).run(); }

int export_log(const std::string& socket, const ExportSettings& settings) { return Export(settings).run(socket); }

}  // namespace prism::prismctl
