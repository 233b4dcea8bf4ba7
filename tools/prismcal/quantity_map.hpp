// SPDX-License-Identifier: MIT
// --map: which column of a table is the rate, the temperature, the voltage, the time or a sensor, and in which unit.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::recordings {

struct MappedColumn {
  std::string column;
  const tables::Unit* unit = nullptr;  ///< null: by the column's header
  double scale = 1, offset = 0;        ///< file value · scale + offset is in `unit`
  bool is_scaled = false;              ///< scale or offset is stated: the unit may differ from the header's
};
/// By "rate", "temperature", "uhfo", "time", or the name of a sensor of a line, LINE.NAME.
using QuantityMap = std::map<std::string, MappedColumn>;

/// True for "daq.uhfo": a sensor, not one of the four.
bool is_sensor(const std::string& quantity);
/// The sensor's unit to which `unit` is converted.
std::string sensor_unit(const tables::Unit& unit);

/// Parses "QUANTITY=COLUMN[:UNIT[*SCALE][+OFFSET]]" entries. Errors: the grammar, an unknown unit, no rate.
Result<QuantityMap> parse_map(const std::vector<std::string>& entries);

/// The unit of a quantity: of the map, else of the header. Errors: neither states one, or they contradict.
Result<const tables::Unit*> unit_of_quantity(const std::string& quantity, const MappedColumn& mapped,
                                             const tables::Header& header);

/// The site in command lines to copy: no table states it. `train` rejects the placeholders.
inline constexpr const char* kSiteOptions = "--latitude DEG --elevation DEG";
inline constexpr const char* kSiteAdvice =
    "DEG: latitude of the site, elevation of the gyro's input axis above the horizon; for rates already corrected for "
    "the Earth rate: --no-earth-rate instead";

/// The first column with the unit of a rate.
std::optional<std::size_t> rate_column(const tables::PlainTable& table);

/// The entries of --map that read these columns, by their units and names; with words in capitals for what no column
/// states. Of several columns that may be a quantity it takes the first.
std::vector<std::string> suggested_map(const tables::PlainTable& table, const tables::TableOptions& options);

/// "prismcal train FILE --map … --latitude DEG --elevation DEG --inputs T,dTdt --out model.json": the command line by
/// the units and names of the columns, with the stated options. "rate=COLUMN:UNIT": no column states it.
std::string train_command(const tables::PlainTable& table, const tables::TableOptions& options);

}  // namespace prism::recordings
