// SPDX-License-Identifier: MIT
// A position in a log. Clients store its text and send it back unchanged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace prism::pipeline {

inline constexpr std::size_t kLogIdChars = 32;

/// True for the 32 hex digits of LogPosition::log.
bool is_log_id(std::string_view text);

/// The position after a row.
struct RowCursor {
  std::string log;            ///< LogPosition::log; all zeros: of a log without a row yet
  std::uint64_t segment = 0;  ///< its number; 0: before the first
  std::uint64_t row = 0;      ///< row in the segment, from 1; 0: before the first
  std::uint64_t total = 0;    ///< rows of the log up to here, with deleted ones; used to count missing rows

  std::string text() const;
  /// Returns nullopt if the text is invalid.
  static std::optional<RowCursor> parse(std::string_view text);

  bool operator==(const RowCursor&) const = default;
};

}  // namespace prism::pipeline
