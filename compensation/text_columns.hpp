// SPDX-License-Identifier: MIT
// Sensors of an instrument that prints lines of numbers: maps columns to sensors.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "compensation/sensors.hpp"

namespace prism {

struct TextColumn {
  SensorName sensor;
  int column = 0;                                      ///< from 0
  double min = std::numeric_limits<double>::lowest();  ///< in the sensor's unit; values outside are unknown
  double max = std::numeric_limits<double>::max();

  bool operator==(const TextColumn&) const = default;
};

/// The frame description defines how to find a line; this defines its content.
struct TextColumns {
  std::vector<TextColumn> columns = {};  ///< empty: the description's own sensors
  std::string separators = ",;\t";       ///< if only blanks, a run of them counts as one
  bool ends_with_cr = false;             ///< a line ends with CR alone, otherwise with LF or CR LF
  bool decimal_comma = false;            ///< "23,5"

  bool operator==(const TextColumns&) const = default;
};

/// Why these characters cannot be separators; empty: they can. The word "semicolon" would be nine of them.
std::string separators_problem(const std::string& separators);

}  // namespace prism
