// SPDX-License-Identifier: MIT
#include "compensation/compensated_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <set>
#include <utility>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "compensation/log_columns.hpp"

namespace prism::compensation {

std::string csv_columns(const std::vector<SensorName>& sensors) {
  std::string line;
  for (const LogColumn& column : kLogColumns) {
    if (&column == &kLogColumns.back()) {
      for (const SensorName& sensor : sensors) line += "," + sensor_column(sensor);
    }
    line += (line.empty() ? "" : ",") + std::string(column.name);
  }
  return line;
}

namespace {
constexpr std::string_view kSensorsKey = "# sensors: ";
}  // namespace

std::string sensors_line(const std::vector<SensorName>& sensors) {
  if (sensors.empty()) return "";
  std::string line(kSensorsKey);
  for (const SensorName& sensor : sensors) line += (&sensor == &sensors.front() ? "" : " ") + sensor_column(sensor);
  return line + "\n";
}

std::vector<SensorName> sensors_in(std::string_view metadata) {
  std::vector<SensorName> sensors;
  const std::size_t at = metadata.find(kSensorsKey);
  if (at == std::string_view::npos) return sensors;
  std::string_view rest = metadata.substr(at + kSensorsKey.size());
  rest = rest.substr(0, rest.find('\n'));
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (auto sensor = sensor_of_column(rest.substr(0, end))) sensors.push_back(std::move(*sensor));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return sensors;
}

void append_csv(std::string& text, const CompensatedWindow& row) {
  for (std::size_t i = 0; i < kLogColumns.size(); ++i) {
    if (i + 1 == kLogColumns.size()) {
      for (const double value : row.window.second_mean.sensors) {
        text += ',';
        append_fixed(text, value, kSensorDecimals);
      }
    }
    if (i > 0) text += ',';
    kLogColumns[i].append(text, row);
  }
  text += '\n';
}

CsvLayout::CsvLayout() : known_(kLogColumns.size()) { std::iota(known_.begin(), known_.end(), std::size_t{0}); }

Result<CsvLayout> CsvLayout::parse(std::string_view columns, std::string_view where, SensorList sensors) {
  CsvLayout layout;
  std::vector<std::string> wanted;
  if (sensors && sensors->empty()) sensors = nullptr;
  for (const SensorName& sensor : sensors ? *sensors : std::vector<SensorName>())
    wanted.push_back(sensor_column(sensor));
  layout.sensors_ = std::move(sensors);
  layout.known_.clear();
  std::set<std::string_view> names;
  for (std::size_t begin = 0, end = 0; end != columns.size(); begin = end + 1) {
    end = std::min(columns.find(',', begin), columns.size());
    const std::string_view name = columns.substr(begin, end - begin);
    if (!names.insert(name).second)
      return make_error(std::string(where), fmt::format("found column \"{}\" twice", plain_text(name)));
    const auto known = std::find_if(kLogColumns.begin(), kLogColumns.end(),
                                    [name](const LogColumn& column) { return column.name == name; });
    const auto sensor = std::find(wanted.begin(), wanted.end(), name);
    layout.known_.push_back(sensor != wanted.end()       ? kSensors + static_cast<std::size_t>(sensor - wanted.begin())
                            : known == kLogColumns.end() ? kPassedOver
                                                         : static_cast<std::size_t>(known - kLogColumns.begin()));
  }
  for (const std::string& column : wanted) {
    if (!names.contains(column))
      return make_error(std::string(where),
                        fmt::format("found no column \"{}\", which the metadata lists", plain_text(column)));
  }
  for (std::size_t i = 0; i < kColumnsOfFormat1; ++i) {
    if (names.contains(kLogColumns[i].name)) continue;
    return make_error(
        std::string(where),
        fmt::format("not a log of prismd: found no column \"{}\"; prismcal reads any other CSV with --map",
                    kLogColumns[i].name));
  }
  return layout;
}

const double* CsvLayout::real(std::size_t field, const CompensatedWindow& row) const {
  const std::size_t known = field < known_.size() ? known_[field] : kPassedOver;
  if (known == kPassedOver) return nullptr;
  if (known >= kSensors) return &row.window.second_mean.sensors[known - kSensors];
  return kLogColumns[known].value ? &kLogColumns[known].value(row) : nullptr;
}

void CsvLayout::use_second_means(std::optional<std::size_t> also) {
  checked_decimals_.assign(known_.size(), 0);
  for (std::size_t i = 0; i < known_.size(); ++i) {
    if (known_[i] < kLogColumns.size() && !kLogColumns[known_[i]].of_second_mean && i != also)
      checked_decimals_[i] = kLogColumns[known_[i]].decimals;
  }
}

namespace {

/// The end of the field that begins at `at`: a comma, or the end of the line. Fields are short: this takes half the
/// time of memchr().
const char* field_end(const char* at, const char* line_end) {
  constexpr std::uint64_t kOnes = 0x0101010101010101, kHighs = 0x8080808080808080;
  if constexpr (std::endian::native == std::endian::little) {
    for (; line_end - at >= 8; at += 8) {
      std::uint64_t bytes = 0;
      std::memcpy(&bytes, at, sizeof bytes);
      bytes ^= kOnes * ',';  // a comma is now 0; the lowest high bit below is that of the first 0
      if (const std::uint64_t commas = (bytes - kOnes) & ~bytes & kHighs) return at + std::countr_zero(commas) / 8;
    }
  }
  return std::find(at, line_end, ',');
}

}  // namespace

Result<void> read_csv(std::string_view line, std::string_view where, const CsvLayout& layout, CompensatedWindow& row) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  const std::vector<std::size_t>& known = layout.known_;
  Window& window = row.window;
  if (layout.sensors_ && window.second_mean.sensor_list != layout.sensors_) {
    window.second_mean.sensor_list = layout.sensors_;
    window.second_mean.sensors.assign(layout.sensors_->size(), kUnknown);
  }
  const char* const line_end = line.data() + line.size();
  std::size_t count = 0;
  for (const char* begin = line.data();; ++count) {
    const char* const end = field_end(begin, line_end);
    const std::string_view field(begin, end);
    const auto before = static_cast<std::size_t>(begin - line.data());
    const bool checked = count < layout.checked_decimals_.size() && layout.checked_decimals_[count] > 0 &&
                         (field.empty() || is_fixed(field, before, layout.checked_decimals_[count]));
    const bool read = !checked && count < known.size() && known[count] != CsvLayout::kPassedOver;
    if (read && known[count] >= CsvLayout::kSensors) {
      if (!column::parse(field, before, window.second_mean.sensors[known[count] - CsvLayout::kSensors],
                         kSensorDecimals))
        return make_error(std::string(where),
                          fmt::format("sensor: found \"{}\", expected a number", plain_text(field)));
    } else if (read && !kLogColumns[known[count]].parse(field, before, row)) {
      return make_error(std::string(where), fmt::format("column {}: found \"{}\", expected a valid value",
                                                        kLogColumns[known[count]].name, plain_text(field)));
    }
    if (end == line_end) break;
    begin = end + 1;
  }
  if (count + 1 != known.size()) {
    return make_error(std::string(where), fmt::format("found {} columns, expected {}", count + 1, known.size()));
  }
  const bool ready = std::isfinite(window.slope_degc_per_s) && std::isfinite(window.temperature_degc) &&
                     std::isfinite(window.rate_deg_per_h);
  window.state = ready ? WindowState::kReady : WindowState::kWarming;
  return {};
}

Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where, const CsvLayout& layout) {
  CompensatedWindow row;
  if (auto good = read_csv(line, where, layout, row); !good) return tl::unexpected<Error>(std::move(good.error()));
  return row;
}

}  // namespace prism::compensation
