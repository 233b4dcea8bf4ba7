// SPDX-License-Identifier: MIT
// A place in a log, as clients hold it: they hand it back as it is.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace prism::pipeline {

/// Behind a row.
struct RowCursor {
  std::string log;            ///< id of the segment index: another one is another log
  std::uint64_t segment = 0;  ///< its number; 0: before the first
  std::uint64_t row = 0;      ///< in it, from 1; 0: before its first
  std::uint64_t total = 0;    ///< rows of the log up to here, deleted ones too: tells how many are missing

  std::string text() const;
  /// Nothing where the text is none.
  static std::optional<RowCursor> parse(std::string_view text);

  bool operator==(const RowCursor&) const = default;
};

}  // namespace prism::pipeline
