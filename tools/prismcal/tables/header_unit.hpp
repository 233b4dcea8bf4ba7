// SPDX-License-Identifier: MIT
// The name and the unit in a column's header: "Rate [deg/h]", "gyro_x (rad/s)", "Temp_degC", "U_HFO [mV]".
#pragma once

#include <string>
#include <string_view>

#include "tools/prismcal/tables/units.hpp"

namespace prism::tables {

struct Header {
  std::string text;            ///< as in the file
  std::string name;            ///< without the unit
  const Unit* unit = nullptr;  ///< null: none that prism knows
  bool stated = false;         ///< in brackets or in a row of units, not only as the end of the name
};

/// `unit_text`: the cell of a row of units; empty: none.
Header read_header(std::string_view text, std::string_view unit_text = {});

/// The unit of one of its spellings, of any quantity; null: unknown.
const Unit* unit_of(std::string_view spelling);

/// True if a row of units may have this cell: a spelling of a unit, with brackets or without, or nothing.
bool is_unit_cell(std::string_view cell);

}  // namespace prism::tables
