// SPDX-License-Identifier: MIT
// Sensors of an instrument that prints lines of numbers: which column is which.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "compensation/sensors.hpp"

namespace prism {

struct TextColumn {
  SensorName sensor;
  int column = 0;                                      ///< from 0
  double min = std::numeric_limits<double>::lowest();  ///< in the sensor's unit; beyond them it is not known
  double max = std::numeric_limits<double>::max();

  bool operator==(const TextColumn&) const = default;
};

/// A frame description of text lines says how a line is found, this what stands in it.
struct TextColumns {
  std::vector<TextColumn> columns = {};  ///< empty: the description's own sensors
  std::string separators = ",;\t";       ///< blanks alone: runs of them count as one
  bool ends_with_cr = false;             ///< a line ends with CR alone, else with LF or CR LF
  bool decimal_comma = false;            ///< "23,5"

  bool operator==(const TextColumns&) const = default;
};

}  // namespace prism
