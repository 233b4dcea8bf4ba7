// SPDX-License-Identifier: MIT
// Units of the columns of tables, and their conversion to those of prism.
#pragma once

#include <numbers>
#include <string_view>

namespace prism::tables {

/// value · factor + offset: deg/h, degC, V or s.
struct Unit {
  std::string_view quantity, name;
  double factor, offset;
};

inline constexpr Unit kUnits[] = {
    {"rate", "deg/h", 1, 0},
    {"rate", "arcsec/s", 1, 0},
    {"rate", "deg/s", 3600, 0},
    {"rate", "rad/s", 3600 * 180 / std::numbers::pi, 0},
    {"temperature", "degC", 1, 0},
    {"temperature", "K", 1, -273.15},
    {"temperature", "degF", 5.0 / 9, -160.0 / 9},
    {"uhfo", "V", 1, 0},
    {"uhfo", "mV", 1e-3, 0},
    {"time", "s", 1, 0},
    {"time", "ms", 1e-3, 0},
    {"time", "us", 1e-6, 0},
    {"time", "ns", 1e-9, 0},
    {"time", "min", 60, 0},
    {"time", "h", 3600, 0},
    {"time", "d", 86400, 0},
};

/// Returns null if there is no such unit.
constexpr const Unit* find_unit(std::string_view quantity, std::string_view name) {
  for (const Unit& unit : kUnits) {
    if (unit.quantity == quantity && unit.name == name) return &unit;
  }
  return nullptr;
}

}  // namespace prism::tables
