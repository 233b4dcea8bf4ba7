// SPDX-License-Identifier: MIT
#include "daemon/pipeline/row_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace prism::pipeline {
namespace {

constexpr std::size_t kIdChars = 32;

bool take_number(std::string_view& text, std::uint64_t& number) {
  if (!text.starts_with('-')) return false;
  text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end == text.data()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

std::string RowCursor::text() const { return fmt::format("{}-{}-{}-{}", log, segment, row, total); }

std::optional<RowCursor> RowCursor::parse(std::string_view text) {
  const auto hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (text.size() < kIdChars || !std::all_of(text.begin(), text.begin() + kIdChars, hex)) return std::nullopt;
  RowCursor cursor;
  cursor.log = text.substr(0, kIdChars);
  text.remove_prefix(kIdChars);
  const bool good =
      take_number(text, cursor.segment) && take_number(text, cursor.row) && take_number(text, cursor.total);
  return good && text.empty() ? std::optional(cursor) : std::nullopt;
}

}  // namespace prism::pipeline
