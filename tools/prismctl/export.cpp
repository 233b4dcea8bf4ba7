// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
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

constexpr std::uint64_t kPageRows = 10'000;

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

/// Number of the column `name` in a line of names.
std::optional<std::size_t> column_of(std::string_view names, std::string_view name) {
  for (std::size_t column = 0;; ++column) {
    const std::size_t end = std::min(names.find(','), names.size());
    if (names.substr(0, end) == name) return column;
    if (end == names.size()) return std::nullopt;
    names.remove_prefix(end + 1);
  }
}

std::optional<std::int64_t> integer_at(std::string_view row, std::size_t column) {
  for (; column > 0; --column) row.remove_prefix(std::min(row.find(','), row.size() - 1) + 1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(row.data(), row.data() + row.size(), value);
  return error == std::errc() && end != row.data() ? std::optional(value) : std::nullopt;
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
    json params = {{"axis", axis}, {"after", "earliest"}, {"limit", kPageRows}, {"header", true}};
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

  static Result<std::int64_t> time_of(const char* option, const std::string& text, std::int64_t otherwise) {
    if (text.empty()) return otherwise;
    if (const auto time = time_in(text)) return *time;
    return make_error(option, fmt::format("found \"{}\", expected a time in UTC such as 2026-11-23T09:11:00", text));
  }

  Result<void> prepare() {
    const auto from = time_of("--from", settings_.from, std::numeric_limits<std::int64_t>::min());
    if (!from) return tl::unexpected<Error>(from.error());
    const auto to = time_of("--to", settings_.to, std::numeric_limits<std::int64_t>::max());
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
    const auto column = column_of(columns, "time_s");
    if (!column) return make_error(name, "found no column time_s");
    for (const json& row : at(segment, "rows")) {
      const std::string line = row.is_string() ? row.get<std::string>() : "";
      const auto time = integer_at(line, *column);
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
  std::int64_t from_ = 0, to_ = 0;
  std::string name_, text_;  ///< of the current file
  std::uint64_t file_rows_ = 0, rows_ = 0, files_ = 0, missing_ = 0;
};

}  // namespace

int export_log(const std::string& socket, const ExportSettings& settings) { return Export(settings).run(socket); }

}  // namespace prism::prismctl
