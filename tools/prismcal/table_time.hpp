// SPDX-License-Identifier: MIT
// The time of a row: ISO 8601, or a number with a unit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tools/prismcal/units.hpp"

namespace prism::tables {

struct IsoTime {
  std::int64_t ns = 0;  ///< since 1970 UTC; without a zone as if it were UTC
  bool has_clock = false, has_zone = false;
};

/// Reads "2024-03-25", "2024-03-25T12:00", "2024-03-25 12:00:00.5Z" and "… 12:00:00,5+02:00". Returns nullopt for any
/// other text, a date or time of day that does not exist, and for years before 1900 and after 2150.
std::optional<IsoTime> iso_time(std::string_view text);

/// How a column of times is read.
struct TimeFormat {
  const Unit* unit = nullptr;  ///< of a number; null: ISO 8601
  bool has_zone = false;
  double scale = 1, offset = 0;  ///< applied to a number first (--map)

  bool is_date() const { return unit == nullptr; }
  /// For the line of how the file was understood.
  std::string text() const;
  /// The number of a cell, whose text is `cell`, in ns; nullopt beyond 142 years.
  std::optional<std::int64_t> of_number(std::string_view cell, double number) const;
};

/// A time in a message: "2026-11-23T09:11:00.5Z", or "7001.5 s" without a date.
std::string time_text(std::int64_t time_ns, bool is_date);

}  // namespace prism::tables
