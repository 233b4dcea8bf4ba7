// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "tools/client/client.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

namespace asio = boost::asio;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kWait_s = 5;  // less than Client::kTimeout
constexpr std::uint64_t kPage = 2000;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  for (std::size_t begin = 0, end = 0; end != line.size(); begin = end + 1) {
    end = std::min(line.find(',', begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
  }
  return fields;
}

ordered_json value_of(const std::string& field) {
  if (field.empty()) return nullptr;
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc() || end != field.data() + field.size()) return field;
  return ordered_json::parse(field, nullptr, false);
}

ordered_json object_of(const std::string& columns, const std::string& line, const json& segment, std::uint64_t row) {
  ordered_json object = {{"segment", segment}, {"row", row}};
  const std::vector<std::string> names = fields_of(columns), fields = fields_of(line);
  for (std::size_t i = 0; i < std::min(names.size(), fields.size()); ++i) object[names[i]] = value_of(fields[i]);
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
      : client_(io_, socket), settings_(settings), cursor_(settings.after) {
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
      if (settings_.json) print_json(object_of(columns, line, at(segment, "segment"), number));
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
  std::string cursor_, columns_;
  std::uint64_t rows_ = 0;
  Result<void> result_;
  bool retrying_ = false;
};

}  // namespace

int rows(const std::string& socket, const RowsSettings& settings) { return Follower(socket, settings).run(); }

}  // namespace prism::prismctl
