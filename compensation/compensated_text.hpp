// SPDX-License-Identifier: MIT
// Compensated rows as text: the CSV of the log (written and read) and the JSON of the socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensated.hpp"

namespace prism::compensation {

// The columns of the log: the one table from which the CSV, the socket's JSON and the database of prismrelay follow.
// Tests compare docs/formats.md and the Python client with it.

enum class ColumnType {
  kTime,      ///< written and read by its own functions
  kReal,      ///< a double, in JSON a number or null
  kInteger,   ///< fits 32 bits with sign
  kUnsigned,  ///< 32 bits without sign
  kFlag,      ///< 0 or 1
  kText,      ///< letters, '_' and '+'
};

/// The values and texts of a column.
struct LogColumn {
  std::string_view name, unit;
  ColumnType type;
  int json;  ///< position in the window notification, from 1; 0: not in it
  /// Appends nothing if the value is unknown.
  void (*append)(std::string& text, const CompensatedWindow& row);
  /// Sets the value, whatever it was before. Returns false if the field is invalid. `before`: bytes before the field
  /// that may be read.
  bool (*parse)(std::string_view field, std::size_t before, CompensatedWindow& row);
  /// The value of a row; null if the type is not kInteger, kUnsigned or kFlag.
  std::int64_t (*number)(const CompensatedWindow& row) = nullptr;
  /// The value of a row; null if the type is not kReal.
  const double& (*value)(const CompensatedWindow& row) = nullptr;
  int decimals = 0;            ///< of kReal
  bool of_second_mean = true;  ///< of kReal: the value is part of the row's SecondMean
};

/// In the order of the log. time_utc and time_s are the end of the second: the end of the data in this row.
std::span<const LogColumn> log_columns();
/// Columns after these are optional when a log is read.
inline constexpr std::size_t kColumnsOfFormat1 = 17;
/// Returns the column; nullptr for an unknown name.
const LogColumn* find_column(std::string_view name);

/// The column line of the log, without its line end. The columns of `sensors` are before the last one.
std::string csv_columns(const std::vector<SensorName>& sensors = {});

/// The sensors of a list of columns: "case_degc anode_v".
std::vector<SensorName> listed_sensors(std::string_view columns);
/// Those that the metadata of a log lists: "# sensors: case_degc anode_v\n".
std::vector<SensorName> sensors_in(std::string_view metadata);
/// That metadata line; empty without sensors.
std::string sensors_line(const std::vector<SensorName>& sensors);

/// One row, with its line end. Unknown quantities are empty fields. Decimals: rates and U 6, temperatures 5, slope 8.
void append_csv(std::string& text, const CompensatedWindow& row);

/// Maps the columns of a log to fields by name, because columns were added at the end and more may follow.
class CsvLayout {
 public:
  /// The layout of csv_columns().
  CsvLayout();
  /// The layout of any log, of this or another version. Errors: a duplicate name; a missing column of format 1; a
  /// missing column of `sensors`, which the metadata lists. Skips columns with unknown names.
  static Result<CsvLayout> parse(std::string_view columns, std::string_view where, SensorList sensors = nullptr);
  /// The value of a row that this layout has filled; nullptr if the field is not a plain number of a known column.
  const double* real(std::size_t field, const CompensatedWindow& row) const;
  /// For readers that use only the second mean of a row, and the field `also`: other numbers are checked, which is
  /// faster, and their values and the state of the window are undefined.
  void use_second_means(std::optional<std::size_t> also);

 private:
  friend Result<void> read_csv(std::string_view, std::string_view, const CsvLayout&, CompensatedWindow&);
  static constexpr std::size_t kPassedOver = SIZE_MAX, kSensors = 1000;
  struct Field {
    std::size_t known = kPassedOver;  ///< index of its column in append_csv(), or kSensors + index of the sensor
    int checked_decimals = 0;         ///< not 0 if its number is checked only
  };
  std::vector<Field> fields_;
  SensorList sensors_;
};

/// Reads one row (line end optional); fields without a column keep their defaults. `where` names the line in errors.
Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where,
                                    const CsvLayout& layout = CsvLayout());

/// The same into a row that is as constructed, or that this function has filled by this layout: without allocations.
Result<void> read_csv(std::string_view line, std::string_view where, const CsvLayout& layout, CompensatedWindow& row);

/// The "params" of a sample notification: {"time_s":…,"rate_deg_per_h":…,…}. Unknown quantities are null.
void append_json(std::string& text, const Compensated& row);
/// The "params" of a window notification; "sensors" contains their means over the second, if there are any.
void append_json(std::string& text, const CompensatedWindow& row);

}  // namespace prism::compensation
