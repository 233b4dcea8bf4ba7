// SPDX-License-Identifier: MIT
// --map: which column of a table is the rate, the temperature, the voltage and the time, and in which unit.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/tables/header_unit.hpp"
#include "tools/prismcal/tables/table_source.hpp"
#include "tools/prismcal/tables/units.hpp"

namespace prism::recordings {

struct MappedColumn {
  std::string column;
  const tables::Unit* unit = nullptr;  ///< null: by the column's header
  double scale = 1, offset = 0;        ///< file value · scale + offset is in `unit`
};
using QuantityMap = std::map<std::string, MappedColumn>;

/// Parses "QUANTITY=COLUMN[:UNIT[*SCALE][+OFFSET]]" entries. Errors: the grammar, an unknown unit, no rate.
Result<QuantityMap> parse_map(const std::vector<std::string>& entries);

/// The unit of a quantity: of the map, else of the header. Errors: neither states one.
Result<const tables::Unit*> unit_of_quantity(const std::string& quantity, const MappedColumn& mapped,
                                             const tables::Header& header);

/// The entries of --map that read these columns, by their units and names; empty if no rate is recognised. A quantity
/// that several columns may be takes the first.
std::vector<std::string> suggested_map(const tables::TableSource& table);

/// "prismcal train FILE --map … --no-earth-rate --inputs T,dTdt --out model.json": the finished command line, with
/// suggested_map(); empty if no rate is recognised.
std::string train_command(const tables::TableSource& table);

/// A word for a shell: in quotes if it needs them.
std::string shell_word(const std::string& word);

}  // namespace prism::recordings
