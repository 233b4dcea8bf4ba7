// SPDX-License-Identifier: MIT
// Compensated rows as text: the CSV of the log (and back), and the JSON of the socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensated.hpp"

namespace prism::compensation {

/// Decimal places of what is written.
inline constexpr int kRateDecimals = 6, kTemperatureDecimals = 5, kUhfoDecimals = 6, kSlopeDecimals = 8,
                     kSensorDecimals = 6;

/// The column line of the log, without its line end. Columns of `sensors` stand before the last one.
std::string csv_columns(const std::vector<SensorName>& sensors = {});

/// The sensors whose columns the metadata names: "# sensors: case_degc anode_v\n".
std::vector<SensorName> sensors_in(std::string_view metadata);
/// The line that says so; nothing where there are none.
std::string sensors_line(const std::vector<SensorName>& sensors);

/// One row, with its line end. Unknown quantities are empty fields. Decimals: rates and U 6, temperatures 5, slope 8.
void append_csv(std::string& text, const CompensatedWindow& row);

/// Where a log's line of columns puts what prism knows. Logs are read by names: columns were added at the end, and will
/// be.
class CsvLayout {
 public:
  /// As csv_columns() has it.
  CsvLayout();
  /// Of any log, this version's or another's. Refused: a name twice, or one of the columns missing that every log has
  /// (those of format 1), or one of `sensors`, which the metadata names. Columns of unknown names are passed over.
  static Result<CsvLayout> parse(std::string_view columns, std::string_view where, SensorList sensors = nullptr);

 private:
  friend Result<CompensatedWindow> parse_csv(std::string_view, std::string_view, const CsvLayout&);
  static constexpr std::size_t kPassedOver = SIZE_MAX;
  /// For each field, which column of append_csv it is, or kSensors and which of the sensors.
  std::vector<std::size_t> known_;
  static constexpr std::size_t kSensors = 1000;
  SensorList sensors_;
};

/// Reads one row back (line end optional); what the columns do not carry stays at its default. `where` names the line.
Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where,
                                    const CsvLayout& layout = CsvLayout());

/// What put_json needs at most.
inline constexpr std::size_t kJsonChars = 1024;

/// The "params" of a sample notification: {"time_s":…,"rate_deg_per_h":…,…}. Unknown quantities are null. Writes at
/// `at`, which has room for kJsonChars, and returns the end of what was written.
char* put_json(char* at, const Compensated& row);
/// The same, appended.
void append_json(std::string& text, const Compensated& row);
/// The "params" of a window notification; with "sensors" where there are some: their means over the second.
void append_json(std::string& text, const CompensatedWindow& row);

}  // namespace prism::compensation
