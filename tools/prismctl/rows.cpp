// SPDX-License-Identifier: MIT
#include "tools/prismctl/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "tools/client/connection.hpp"
#include "tools/prismctl/output.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kWait_s = 5;  // less than the response timeout of Connection
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

class Printer {
 public:
  explicit Printer(bool as_json) : json_(as_json) {}

  void page(const json& page) {
    for (const json& segment : at(page, "segments")) {
      const std::string columns = text_member(segment, "columns");
      if (!json_ && columns != columns_) print_log_line(columns);
      columns_ = columns;
      std::uint64_t row = count_member(segment, "first");
      for (const json& line : at(segment, "rows")) put(segment, row++, line.is_string() ? line.get<std::string>() : "");
    }
    std::fflush(stdout);
  }
  std::uint64_t rows() const { return rows_; }

 private:
  void put(const json& segment, std::uint64_t row, const std::string& line) {
    ++rows_;
    if (!json_) return print_log_line(line);
    ordered_json object = {{"segment", at(segment, "segment")}, {"row", row}};
    const std::vector<std::string> names = fields_of(columns_), fields = fields_of(line);
    for (std::size_t i = 0; i < std::min(names.size(), fields.size()); ++i) object[names[i]] = value_of(fields[i]);
    print_json(object);
  }

  bool json_;
  std::string columns_;
  std::uint64_t rows_ = 0;
};

class Follower {
 public:
  Follower(const std::string& socket, const RowsSettings& settings)
      : socket_(socket), settings_(settings), printer_(settings.json), cursor_(settings.after) {}

  int run() {
    if (const auto begun = begin(); !begun) return fail(begun.error());
    for (;;) {
      const auto more = page();
      if (!more) {
        if (!settings_.follow || !is_temporary(more.error().code)) return fail(more.error().error);
        connection_.reset();
        pause(more.error().error);
      } else if (!*more) {
        break;
      }
    }
    if (settings_.cursor_file.empty())
      fmt::print(stderr, "prismctl: {} rows; continue with --after {}\n", printer_.rows(), cursor_);
    return 0;
  }

 private:
  using PageResult = tl::expected<bool, client::RequestError>;

  static bool is_temporary(config::SocketError code) {
    return code == config::kGone || code == config::kTimeout || code == config::kBusy;
  }
  static PageResult failed(config::SocketError code, const Error& error) {
    return PageResult(tl::unexpect, client::RequestError{code, error});
  }
  static int fail(const Error& error) {
    fmt::print(stderr, "prismctl: {}\n", error.text());
    return 1;
  }

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

  // Prints one page. Returns false at the end.
  PageResult page() {
    if (!connection_) {
      auto opened = client::DaemonConnection::open(socket_);
      if (!opened) return failed(config::kGone, opened.error());
      connection_.emplace(std::move(*opened));
    }
    const std::uint64_t left = settings_.limit > 0 ? settings_.limit - printer_.rows() : kPage;
    json params = {{"limit", std::min(left, kPage)}, {"wait_s", settings_.follow ? kWait_s : 0}};
    if (!cursor_.empty()) params["after"] = cursor_;
    if (!settings_.axis.empty()) params["axis"] = settings_.axis;
    const auto answer = connection_->ask("rows", params);
    if (!answer) return tl::unexpected(answer.error());
    retrying_ = false;
    const json& page = client::of_axis(*answer, settings_.axis);
    if (const json& missing = at(page, "missing"); missing.is_number() && missing > 0)
      fmt::print(stderr, "prismctl: {} rows are missing here: deleted or damaged before they were fetched\n",
                 json_text(missing));
    printer_.page(page);
    cursor_ = text_member(page, "after", cursor_);
    if (const auto stored = store_cursor(); !stored) return failed(config::kFailed, stored.error());
    const bool enough = settings_.limit > 0 && printer_.rows() >= settings_.limit;
    return !enough && (settings_.follow || at(page, "more") == true);
  }

  Result<void> store_cursor() {
    if (auto valid = check_text(TextRule::kText, cursor_, "prismd: after"); !valid) return valid;
    if (settings_.cursor_file.empty()) return {};
    return write_text_file(settings_.cursor_file, cursor_ + "\n");
  }

  void pause(const Error& error) {
    if (!std::exchange(retrying_, true)) fmt::print(stderr, "prismctl: {}; retrying\n", error.text());
    std::this_thread::sleep_for(scaled(std::chrono::seconds(1)));
  }

  std::string socket_;
  RowsSettings settings_;
  Printer printer_;
  std::string cursor_;
  std::optional<client::DaemonConnection> connection_;
  bool retrying_ = false;
};

}  // namespace

int rows(const std::string& socket, const RowsSettings& settings) { return Follower(socket, settings).run(); }

}  // namespace prism::prismctl
