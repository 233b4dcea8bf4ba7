// SPDX-License-Identifier: MIT
// The name and the unit in a column's header ("Rate [deg/h]", "gyro_x (rad/s)", "Temp_degC"), and the units that prism
// converts.
#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace prism::tables {

/// value · factor + offset: deg/h, degC, V or s.
struct Unit {
  std::string_view quantity, name;
  double factor, offset;
  std::string_view spellings;  ///< of other programs, in lower case, each after a |
};

// The degree sign is "°", micro is "µ" or "μ".
inline constexpr Unit kUnits[] = {
    {"rate", "deg/h", 1, 0, "|deg/h|deg/hr|deg/hour|°/h|°/hr|dph|degph|deg_per_h|deg_h|grad/h|degree/h|degrees/h|"},
    {"rate", "arcsec/s", 1, 0, "|arcsec/s|arcsec_per_s|\"/s|"},
    {"rate", "deg/s", 3600, 0, "|deg/s|deg/sec|°/s|°/sec|dps|degps|deg_per_s|deg_s|grad/s|degree/s|degrees/s|"},
    {"rate", "rad/s", 3600 * 180 / std::numbers::pi, 0, "|rad/s|rad/sec|rads|rad_per_s|rad_s|"},
    {"temperature", "degC", 1, 0, "|degc|°c|℃|deg c|celsius|c|"},
    {"temperature", "K", 1, -273.15, "|k|kelvin|degk|"},
    {"temperature", "degF", 5.0 / 9, -160.0 / 9, "|degf|°f|℉|deg f|fahrenheit|f|"},
    {"uhfo", "V", 1, 0, "|v|volt|volts|"},
    {"uhfo", "mV", 1e-3, 0, "|mv|millivolt|"},
    {"time", "s", 1, 0, "|s|sec|second|seconds|secs|sekunden|"},
    {"time", "ms", 1e-3, 0, "|ms|msec|millisecond|milliseconds|"},
    {"time", "us", 1e-6, 0, "|us|µs|μs|usec|microseconds|"},
    {"time", "ns", 1e-9, 0, "|ns|nsec|nanoseconds|"},
    {"time", "min", 60, 0, "|min|mins|minute|minutes|minuten|"},
    {"time", "h", 3600, 0, "|h|hr|hrs|hour|hours|std|stunden|"},
    {"time", "d", 86400, 0, "|d|day|days|tage|"},
};

/// Returns null if there is no such unit.
constexpr const Unit* find_unit(std::string_view quantity, std::string_view name) {
  for (const Unit& unit : kUnits) {
    if (unit.quantity == quantity && unit.name == name) return &unit;
  }
  return nullptr;
}

struct Header {
  std::string text;            ///< as in the file
  std::string name;            ///< without the unit
  const Unit* unit = nullptr;  ///< null: none that prism knows
  bool stated = false;         ///< in brackets or in a row of units, not only as the end of the name
};

/// `unit_text`: the cell of a row of units; empty: none.
Header read_header(std::string_view text, std::string_view unit_text = {});

/// True if a row of units may have this cell: a spelling of a unit, with brackets or without, or nothing.
bool is_unit_cell(std::string_view cell);

/// Without blanks around it.
std::string_view trimmed(std::string_view text);

/// The parts between commas, without blanks around them; none of an empty text.
std::vector<std::string> list_items(std::string_view text);

/// In lower case, with one degree sign.
std::string lower(std::string_view text);

// The time of a row: ISO 8601, or a number with a unit.

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
