// SPDX-License-Identifier: MIT
// Compensated rows as text: the CSV of the log (written and read) and the JSON of the socket.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/result.hpp"
#include "compensation/compensated.hpp"

namespace prism::compensation {

// The columns of the log: the one table from which the CSV, the socket's JSON and the database of prismrelay follow.
// Tests compare docs/formats.md and the Python client with it.

/// Decimal places in the output.
inline constexpr int kRateDecimals = 6, kTemperatureDecimals = 5, kUhfoDecimals = 6, kSlopeDecimals = 8,
                     kSensorDecimals = 6;

enum class ColumnType {
  kTime,      ///< written and read by its own functions
  kReal,      ///< a double, in JSON a number or null
  kInteger,   ///< fits 32 bits with sign
  kUnsigned,  ///< 32 bits without sign
  kFlag,      ///< 0 or 1
  kText,      ///< letters, '_' and '+'
};

/// Whether a sample notification contains the quantity.
enum class InSample {
  kNo,
  kMeasured,  ///< as measured in the frame; the column has its mean
  kSame,
};

struct ColumnInfo {
  std::string_view name, unit;
  std::string_view meaning;  ///< without the unit; of columns in JSON
  ColumnType type;
  int json;  ///< position in the window notification, from 1; 0: not in it
  InSample in_sample;
};

struct LogColumn : ColumnInfo {
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

/// How columns that are not plain numbers are written and read.
namespace column {

void append_utc(std::string& text, const CompensatedWindow& row);
void append_second(std::string& text, const CompensatedWindow& row);
bool parse_second(std::string_view field, std::size_t before, CompensatedWindow& row);
void append_arrival(std::string& text, const CompensatedWindow& row);
bool parse_arrival(std::string_view field, std::size_t before, CompensatedWindow& row);
void append_quality(std::string& text, const CompensatedWindow& row);
bool parse_quality(std::string_view field, std::size_t before, CompensatedWindow& row);
void append_partial(std::string& text, const CompensatedWindow& row);
bool parse_partial(std::string_view field, std::size_t before, CompensatedWindow& row);

void append(std::string& text, double value, int decimals);
void append(std::string& text, std::uint32_t value);
bool parse(std::string_view field, std::size_t before, double& value, int decimals);
bool parse(std::string_view field, std::size_t before, std::uint32_t& value);

template <class Class, class Value>
constexpr bool is_member_of_second(Value Class::* /*member*/) {
  return std::is_same_v<Class, SecondMean>;
}

/// `path`: pointers to members, from the row to the value.
template <int decimals, auto... path>
constexpr LogColumn real(std::string_view name, std::string_view unit, std::string_view meaning, int json,
                         InSample in_sample) {
  return {{name, unit, meaning, ColumnType::kReal, json, in_sample},
          [](std::string& text, const CompensatedWindow& row) { append(text, (row.*....*path), decimals); },
          [](std::string_view field, std::size_t before, CompensatedWindow& row) {
            return parse(field, before, (row.*....*path), decimals);
          },
          nullptr,
          [](const CompensatedWindow& row) -> const double& { return (row.*....*path); },
          decimals,
          (is_member_of_second(path) || ...)};
}

template <auto... path>
constexpr LogColumn count(std::string_view name, ColumnType type, std::string_view meaning, int json) {
  return {{name, "", meaning, type, json, InSample::kNo},
          [](std::string& text, const CompensatedWindow& row) { append(text, (row.*....*path)); },
          [](std::string_view field, std::size_t before, CompensatedWindow& row) {
            return parse(field, before, (row.*....*path));
          },
          [](const CompensatedWindow& row) { return std::int64_t{(row.*....*path)}; }};
}

template <int decimals, auto member>
inline constexpr auto* of_second = &real<decimals, &CompensatedWindow::window, &Window::second_mean, member>;
template <auto member>
inline constexpr auto* count_of_second = &count<&CompensatedWindow::window, &Window::second_mean, member>;
template <int decimals, auto member>
inline constexpr auto* of_window = &real<decimals, &CompensatedWindow::window, member>;
template <auto member>
inline constexpr auto* of_correction = &real<kRateDecimals, &CompensatedWindow::correction, member>;
template <auto member>
inline constexpr auto* of_row = &real<kRateDecimals, member>;
}  // namespace column

/// In the order of the log. time_utc and time_s are the end of the second: the end of the data in this row.
inline constexpr std::array kLogColumns = [] {
  using namespace column;
  using enum ColumnType;
  using enum InSample;
  using Row = CompensatedWindow;
  // clang-format off
  return std::array{
      LogColumn{{"time_utc", "", "", kTime, 0, kNo}, append_utc, [](std::string_view, std::size_t, Row&) { return true; }},
      LogColumn{{"time_s", "s", "time of the data", kTime, 1, kSame}, append_second, parse_second},
      count_of_second<&SecondMean::samples>("samples", kInteger, "frames in the second", 2),
      count_of_second<&SecondMean::missing_frames>("missing", kUnsigned, "frames missing in the second", 3),
      of_second<kRateDecimals, &SecondMean::rate_deg_per_h>("rate_deg_per_h", "deg/h", "mean of the second", 4, kMeasured),
      of_second<kTemperatureDecimals, &SecondMean::temperature_degc>("temperature_degc", "degC", "mean of the second", 5, kMeasured),
      of_second<kUhfoDecimals, &SecondMean::uhfo_v>("uhfo_v", "V", "mean of the second", 6, kMeasured),
      count_of_second<&SecondMean::status>("status", kUnsigned, "", 0),
      of_window<kRateDecimals, &Window::rate_deg_per_h>("mean_rate_deg_per_h", "deg/h", "mean of the window", 7, kNo),
      of_window<kTemperatureDecimals, &Window::temperature_degc>("mean_temperature_degc", "degC", "mean of the window", 8, kNo),
      of_window<kSlopeDecimals, &Window::slope_degc_per_s>("slope_degc_per_s", "degC/s", "temperature slope in the window", 9, kNo),
      of_window<kUhfoDecimals, &Window::uhfo_v>("mean_uhfo_v", "V", "mean of the window", 10, kNo),
      of_correction<&Correction::bias_deg_per_h>("bias_deg_per_h", "deg/h", "bias of the model", 12, kSame),
      of_correction<&Correction::sd_deg_per_h>("sd_deg_per_h", "deg/h", "standard deviation of the bias", 13, kSame),
      of_row<&Row::corrected_deg_per_h>("corrected_deg_per_h", "deg/h", "rate - bias - offset", 15, kSame),
      of_row<&Row::corrected_mean_deg_per_h>("corrected_mean_deg_per_h", "deg/h", "mean rate of the window - bias - offset", 11, kNo),
      LogColumn{{"quality", "", "good, or reasons separated by +", kText, 16, kSame}, append_quality, column::parse_quality},
      of_correction<&Correction::sd_mean_deg_per_h>(
          "sd_mean_deg_per_h", "deg/h", "standard deviation including the noise of the window's mean rate", 14, kSame),
      LogColumn{{"arrival_s", "s", "", kTime, 0, kNo}, append_arrival, parse_arrival},
      of_row<&Row::sent_deg_per_h>("sent_deg_per_h", "deg/h", "mean of the rates that the first output sent", 17, kNo),
      of_correction<&Correction::offset_deg_per_h>("offset_deg_per_h", "deg/h", "offset by command", 18, kNo),
      // New columns here.
      LogColumn{{"partial", "", "", kFlag, 0, kNo}, append_partial, parse_partial,
                [](const Row& row) { return std::int64_t{row.window.second_mean.partial}; }}};
  // clang-format on
}();
/// Columns after these are optional when a log is read.
inline constexpr std::size_t kColumnsOfFormat1 = 17;

/// The same columns for programs that do not link this module.
inline constexpr std::array kColumnInfo = [] {
  std::array<ColumnInfo, kLogColumns.size()> all{};
  std::ranges::copy(kLogColumns, all.begin());
  return all;
}();

/// Returns the index of a column; the number of columns for an unknown name.
constexpr std::size_t column_index(std::string_view name) {
  return static_cast<std::size_t>(std::ranges::find(kColumnInfo, name, &ColumnInfo::name) - kColumnInfo.begin());
}

/// Indices of the columns in JSON, in their order there.
inline constexpr std::array kJsonColumns = [] {
  constexpr auto count = std::ranges::count_if(kColumnInfo, [](const ColumnInfo& column) { return column.json > 0; });
  std::array<std::size_t, count> indices{};
  for (std::size_t i = 0; i < kColumnInfo.size(); ++i) {
    if (kColumnInfo[i].json > 0) indices.at(static_cast<std::size_t>(kColumnInfo[i].json - 1)) = i;
  }
  return indices;
}();

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
