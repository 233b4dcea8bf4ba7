// SPDX-License-Identifier: MIT
#include "daemon/pipeline/row_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace prism::pipeline {
namespace {

bool take_number(std::string_view& text, std::uint64_t& number) {
  if (!text.starts_with('-')) return false;
  text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end == text.data()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

bool is_log_id(std::string_view text) {
  return text.size() == kLogIdChars &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

std::string RowCursor::text() const { return fmt::format("{}-{}-{}-{}", log, segment, row, total); }

std::optional<RowCursor> RowCursor::parse(std::string_view text) {
  if (!is_log_id(text.substr(0, kLogIdChars))) return std::nullopt;
  RowCursor cursor;
  cursor.log = text.substr(0, kLogIdChars);
  text.remove_prefix(kLogIdChars);
  const bool good =
      take_number(text, cursor.segment) && take_number(text, cursor.row) && take_number(text, cursor.total);
  return good && text.empty() ? std::optional(cursor) : std::nullopt;
}

}  // namespace prism::pipeline
