// SPDX-License-Identifier: MIT
#include "compensation/compensated_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>
#include <type_traits>
#include <utility>

#include "base/text_number.hpp"

namespace prism::compensation {
namespace {

/// Decimal places in the output.
constexpr int kRateDecimals = 6, kTemperatureDecimals = 5, kUhfoDecimals = 6, kSlopeDecimals = 8, kSensorDecimals = 6,
              kArrivalDecimals = 3;
constexpr std::int64_t kFarthestSecond = 9'223'372'036;  // the range of std::int64_t nanoseconds

template <class Number>
bool take_number(std::string_view field, Number& value) {
  const std::optional<Number> number = parse_number<Number>(field);
  if (number) value = *number;
  return number.has_value();
}

void append(std::string& text, double value, int decimals) { append_fixed(text, value, decimals); }

void append(std::string& text, std::uint32_t value) { append_integer(text, value); }

// An empty field is an unknown quantity. A log contains no "nan" or "inf".
bool parse(std::string_view field, std::size_t before, double& value, int decimals) {
  if (parse_fixed(field, before, decimals, value)) return true;
  value = kUnknown;
  return field.empty() || take_number(field, value);
}

bool parse(std::string_view field, std::size_t /*before*/, std::uint32_t& value) { return take_number(field, value); }

void append_utc(std::string& text, const CompensatedWindow& row) {
  text += utc_text(row.window.second_mean.second + 1);
}

void append_second(std::string& text, const CompensatedWindow& row) {
  append_integer(text, row.window.second_mean.second + 1);
}

bool parse_second(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  std::int64_t end_s = 0;
  const bool good = take_number(field, end_s) && end_s >= -kFarthestSecond && end_s <= kFarthestSecond;
  if (good) row.window.second_mean.second = end_s - 1;
  return good;
}

void append_quality(std::string& text, const CompensatedWindow& row) { text += quality_text(row.correction.quality); }

bool parse_quality(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  const bool good = field == "good";
  const std::uint32_t quality = good ? kGood : compensation::parse_quality(field);
  const bool implausible = (quality & kImplausible) != 0;
  SecondMean& second_mean = row.window.second_mean;
  row.correction.quality = quality;
  // The log does not state which quantity was implausible, so the reader uses none of this second.
  second_mean.implausible = second_mean.all_implausible = {implausible, implausible, implausible};
  second_mean.clocks_differ = (quality & kClocksDiffer) != 0;
  if (good) return true;
  // A truncated or unknown name must not read as "good".
  char text[kQualityChars];
  return std::string_view(text, put_quality(text, quality)) == field;
}

void append_arrival(std::string& text, const CompensatedWindow& row) {
  const std::int64_t whole_ms = row.window.second_mean.arrival_ns / 1'000'000;
  if (whole_ms > 0) text += fmt::format("{}.{:03}", whole_ms / 1000, whole_ms % 1000);
}

bool parse_arrival(std::string_view field, std::size_t before, CompensatedWindow& row) {
  double arrival_s = 0;
  if (!field.empty() && !parse(field, before, arrival_s, kArrivalDecimals)) return false;
  if (!(arrival_s >= 0 && arrival_s <= static_cast<double>(kFarthestSecond))) return false;
  row.window.second_mean.arrival_ns = std::llround(arrival_s * 1e3) * 1'000'000;
  return true;
}

void append_partial(std::string& text, const CompensatedWindow& row) {
  text += row.window.second_mean.partial ? '1' : '0';
}

bool parse_partial(std::string_view field, std::size_t /*before*/, CompensatedWindow& row) {
  const char digit = field.size() == 1 ? field.front() : ' ';
  row.window.second_mean.partial = digit == '1';
  return digit == '0' || digit == '1';
}

template <class Class, class Value>
constexpr bool is_member_of_second(Value Class::* /*member*/) {
  return std::is_same_v<Class, SecondMean>;
}

/// `path`: pointers to members, from the row to the value.
template <int decimals, auto... path>
constexpr LogColumn real(std::string_view name, std::string_view unit, int json) {
  return {name,
          unit,
          ColumnType::kReal,
          json,
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
constexpr LogColumn count(std::string_view name, ColumnType type, int json) {
  return {name,
          "",
          type,
          json,
          [](std::string& text, const CompensatedWindow& row) { append(text, (row.*....*path)); },
          [](std::string_view field, std::size_t before, CompensatedWindow& row) {
            return parse(field, before, (row.*....*path));
          },
          [](const CompensatedWindow& row) { return std::int64_t{(row.*....*path)}; }};
}

template <int decimals, auto member>
constexpr auto* of_second = &real<decimals, &CompensatedWindow::window, &Window::second_mean, member>;
template <auto member>
constexpr auto* count_of_second = &count<&CompensatedWindow::window, &Window::second_mean, member>;
template <int decimals, auto member>
constexpr auto* of_window = &real<decimals, &CompensatedWindow::window, member>;
template <auto member>
constexpr auto* of_correction = &real<kRateDecimals, &CompensatedWindow::correction, member>;
template <auto member>
constexpr auto* of_row = &real<kRateDecimals, member>;

constexpr std::array kLogColumns = [] {
  using enum ColumnType;
  using Row = CompensatedWindow;
  // clang-format off
  return std::array{
      LogColumn{"time_utc", "", kTime, 0, append_utc, [](std::string_view, std::size_t, Row&) { return true; }},
      LogColumn{"time_s", "s", kTime, 1, append_second, parse_second},
      count_of_second<&SecondMean::samples>("samples", kInteger, 2),
      count_of_second<&SecondMean::missing_frames>("missing", kUnsigned, 3),
      of_second<kRateDecimals, &SecondMean::rate_deg_per_h>("rate_deg_per_h", "deg/h", 4),
      of_second<kTemperatureDecimals, &SecondMean::temperature_degc>("temperature_degc", "degC", 5),
      of_second<kUhfoDecimals, &SecondMean::uhfo_v>("uhfo_v", "V", 6),
      count_of_second<&SecondMean::status>("status", kUnsigned, 0),
      of_window<kRateDecimals, &Window::rate_deg_per_h>("mean_rate_deg_per_h", "deg/h", 7),
      of_window<kTemperatureDecimals, &Window::temperature_degc>("mean_temperature_degc", "degC", 8),
      of_window<kSlopeDecimals, &Window::slope_degc_per_s>("slope_degc_per_s", "degC/s", 9),
      of_window<kUhfoDecimals, &Window::uhfo_v>("mean_uhfo_v", "V", 10),
      of_correction<&Correction::bias_deg_per_h>("bias_deg_per_h", "deg/h", 12),
      of_correction<&Correction::sd_deg_per_h>("sd_deg_per_h", "deg/h", 13),
      of_row<&Row::corrected_deg_per_h>("corrected_deg_per_h", "deg/h", 15),
      of_row<&Row::corrected_mean_deg_per_h>("corrected_mean_deg_per_h", "deg/h", 11),
      LogColumn{"quality", "", kText, 16, append_quality, parse_quality},
      of_correction<&Correction::sd_mean_deg_per_h>("sd_mean_deg_per_h", "deg/h", 14),
      LogColumn{"arrival_s", "s", kTime, 0, append_arrival, parse_arrival},
      of_row<&Row::sent_deg_per_h>("sent_deg_per_h", "deg/h", 17),
      of_correction<&Correction::offset_deg_per_h>("offset_deg_per_h", "deg/h", 18),
      // New columns here.
      LogColumn{"partial", "", kFlag, 0, append_partial, parse_partial,
                [](const Row& row) { return std::int64_t{row.window.second_mean.partial}; }}};
  // clang-format on
}();

/// Indices of the columns in JSON, in their order there.
constexpr std::array kJsonColumns = [] {
  constexpr auto count = std::ranges::count_if(kLogColumns, [](const LogColumn& column) { return column.json > 0; });
  std::array<std::size_t, count> indices{};
  for (std::size_t i = 0; i < kLogColumns.size(); ++i) {
    if (kLogColumns[i].json > 0) indices.at(static_cast<std::size_t>(kLogColumns[i].json - 1)) = i;
  }
  return indices;
}();

// With one digit in the last column, a truncated row always has too few columns or an empty last one.
static_assert(kLogColumns.back().name == "partial" && kLogColumns.back().type == ColumnType::kFlag);
static_assert(kLogColumns[kColumnsOfFormat1 - 1].name == "quality");
static_assert(kLogColumns[kJsonColumns.front()].name == "time_s");
static_assert(
    [] {
      for (std::size_t i = 0; i < kJsonColumns.size(); ++i) {
        if (kLogColumns[kJsonColumns[i]].json != static_cast<int>(i) + 1) return false;
      }
      return true;
    }(),
    "each position in JSON is used once, from 1 on");

}  // namespace

std::span<const LogColumn> log_columns() { return kLogColumns; }

const LogColumn* find_column(std::string_view name) {
  const auto* const found = std::ranges::find(kLogColumns, name, &LogColumn::name);
  return found == kLogColumns.end() ? nullptr : found;
}

}  // namespace prism::compensation

#ifdef __x86_64__
#include <emmintrin.h>
#endif

#include "base/plain_text.hpp"

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

std::vector<SensorName> listed_sensors(std::string_view columns) {
  std::vector<SensorName> sensors;
  while (!columns.empty()) {
    const std::size_t end = std::min(columns.find(' '), columns.size());
    if (auto sensor = sensor_of_column(columns.substr(0, end))) sensors.push_back(std::move(*sensor));
    columns.remove_prefix(std::min(end + 1, columns.size()));
  }
  return sensors;
}

std::vector<SensorName> sensors_in(std::string_view metadata) {
  const std::size_t at = metadata.find(kSensorsKey);
  if (at == std::string_view::npos) return {};
  const std::string_view rest = metadata.substr(at + kSensorsKey.size());
  return listed_sensors(rest.substr(0, rest.find('\n')));
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

CsvLayout::CsvLayout() {
  for (std::size_t i = 0; i < kLogColumns.size(); ++i) fields_.push_back({.known = i});
}

Result<CsvLayout> CsvLayout::parse(std::string_view columns, std::string_view where, SensorList sensors) {
  CsvLayout layout;
  std::vector<std::string> wanted;
  if (sensors && sensors->empty()) sensors = nullptr;
  for (const SensorName& sensor : sensors ? *sensors : std::vector<SensorName>())
    wanted.push_back(sensor_column(sensor));
  layout.sensors_ = std::move(sensors);
  layout.fields_.clear();
  std::set<std::string_view> names;
  for (std::size_t begin = 0, end = 0; end != columns.size(); begin = end + 1) {
    end = std::min(columns.find(',', begin), columns.size());
    const std::string_view name = columns.substr(begin, end - begin);
    if (!names.insert(name).second)
      return make_error(std::string(where), fmt::format("found column \"{}\" twice", plain_text(name)));
    const LogColumn* const known = find_column(name);
    const auto sensor = std::find(wanted.begin(), wanted.end(), name);
    Field& field = layout.fields_.emplace_back();
    if (sensor != wanted.end()) {
      field.known = kSensors + static_cast<std::size_t>(sensor - wanted.begin());
    } else if (known != nullptr) {
      field.known = static_cast<std::size_t>(known - kLogColumns.begin());
    }
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
  const std::size_t known = field < fields_.size() ? fields_[field].known : kPassedOver;
  if (known == kPassedOver) return nullptr;
  if (known >= kSensors) return &row.window.second_mean.sensors[known - kSensors];
  return kLogColumns[known].value ? &kLogColumns[known].value(row) : nullptr;
}

void CsvLayout::use_second_means(std::optional<std::size_t> also) {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const std::size_t known = fields_[i].known;
    const bool checked = known < kLogColumns.size() && !kLogColumns[known].of_second_mean && i != also;
    fields_[i].checked_decimals = checked ? kLogColumns[known].decimals : 0;
  }
}

namespace {

/// A bit for each comma of 16 bytes, the lowest for the first byte.
unsigned commas_in_16(const char* bytes) {
#ifdef __x86_64__
  const __m128i all = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
  return static_cast<unsigned>(_mm_movemask_epi8(_mm_cmpeq_epi8(all, _mm_set1_epi8(','))));
#else
  unsigned commas = 0;
  for (unsigned i = 0; i < 16; ++i) commas |= static_cast<unsigned>(bytes[i] == ',') << i;
  return commas;
#endif
}

std::uint64_t commas_in_64(const char* bytes) {
  std::uint64_t commas = 0;
  for (int i = 0; i < 64; i += 16) commas |= std::uint64_t{commas_in_16(bytes + i)} << i;
  return commas;
}

/// The commas of a line, in order. Fields are short: to search each takes twice the time.
class Commas {
 public:
  explicit Commas(std::string_view line) : line_(line) {}

  /// The next comma, or the end of the line.
  const char* next() {
    while (left_ == 0) {
      if (at_ == line_.size()) return line_.data() + at_;
      read();
    }
    const char* const comma = begin_ + std::countr_zero(left_);
    left_ &= left_ - 1;
    return comma;
  }

 private:
  void read() {
    begin_ = line_.data() + at_;
    const std::size_t count = std::min<std::size_t>(64, line_.size() - at_);
    if (count == 64) {
      left_ = commas_in_64(begin_);
    } else if (line_.size() >= 64) {
      left_ = commas_in_64(begin_ + count - 64) >> (64 - count);
    } else {
      char last[64] = {};
      std::memcpy(last, begin_, count);
      left_ = commas_in_64(last);
    }
    at_ += count;
  }

  std::string_view line_;
  std::size_t at_ = 0;           ///< the byte after those of left_
  const char* begin_ = nullptr;  ///< the first byte of left_
  std::uint64_t left_ = 0;       ///< commas that next() has not returned
};

}  // namespace

Result<void> read_csv(std::string_view line, std::string_view where, const CsvLayout& layout, CompensatedWindow& row) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  const std::vector<CsvLayout::Field>& fields = layout.fields_;
  Window& window = row.window;
  if (layout.sensors_ && window.second_mean.sensor_list != layout.sensors_) {
    window.second_mean.sensor_list = layout.sensors_;
    window.second_mean.sensors.assign(layout.sensors_->size(), kUnknown);
  }
  const char* const line_end = line.data() + line.size();
  std::size_t count = 0;
  Commas commas(line);
  for (const char* begin = line.data();; ++count) {
    const char* const end = commas.next();
    const std::string_view field(begin, end);
    const auto before = static_cast<std::size_t>(begin - line.data());
    const auto [known, checked_decimals] = count < fields.size() ? fields[count] : CsvLayout::Field{};
    const bool checked = checked_decimals > 0 && (field.empty() || is_fixed(field, before, checked_decimals));
    const bool read = !checked && known != CsvLayout::kPassedOver;
    if (read && known >= CsvLayout::kSensors) {
      if (!parse(field, before, window.second_mean.sensors[known - CsvLayout::kSensors], kSensorDecimals))
        return make_error(std::string(where),
                          fmt::format("sensor: found \"{}\", expected a number", plain_text(field)));
    } else if (read && !kLogColumns[known].parse(field, before, row)) {
      return make_error(std::string(where), fmt::format("column {}: found \"{}\", expected a valid value",
                                                        kLogColumns[known].name, plain_text(field)));
    }
    if (end == line_end) break;
    begin = end + 1;
  }
  if (count + 1 != fields.size()) {
    return make_error(std::string(where), fmt::format("found {} columns, expected {}", count + 1, fields.size()));
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

namespace prism::compensation {

// Rows as the JSON of the socket.

namespace {

struct SampleMember {
  std::string_view key;
  int decimals;
  double (*value)(const Compensated& row);
};

constexpr std::string_view kTimeKey = "{\"time_s\":", kQualityKey = ",\"quality\":\"", kSampleEnd = "\"}",
                           kUnknownJson = "null";
constexpr std::array kSampleMembers = {
    SampleMember{",\"rate_deg_per_h\":", kRateDecimals, [](const Compensated& r) { return r.sample.rate_deg_per_h; }},
    SampleMember{",\"temperature_degc\":", kTemperatureDecimals,
                 [](const Compensated& r) { return r.sample.temperature_degc; }},
    SampleMember{",\"uhfo_v\":", kUhfoDecimals, [](const Compensated& r) { return r.sample.uhfo_v; }},
    SampleMember{",\"bias_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.correction.bias_deg_per_h; }},
    SampleMember{",\"sd_deg_per_h\":", kRateDecimals, [](const Compensated& r) { return r.correction.sd_deg_per_h; }},
    SampleMember{",\"sd_mean_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.correction.sd_mean_deg_per_h; }},
    SampleMember{",\"corrected_deg_per_h\":", kRateDecimals,
                 [](const Compensated& r) { return r.corrected_deg_per_h; }}};

constexpr std::size_t most_sample_chars() {
  std::size_t chars = kTimeKey.size() + kNumberChars + kQualityKey.size() + kQualityChars + kSampleEnd.size();
  for (const SampleMember& member : kSampleMembers) chars += member.key.size() + kNumberChars;
  return chars;
}

// One JSON object, built in place: growing a std::string costs more per frame than its numbers.
class JsonWriter {
 public:
  explicit JsonWriter(char* at) : end_(at) {}
  void put(std::string_view text) { end_ = std::copy_n(text.data(), text.size(), end_); }
  void member(const SampleMember& member, const Compensated& row) {
    put(member.key);
    const double value = member.value(row);
    if (std::isfinite(value)) {
      end_ = put_fixed(end_, value, member.decimals);
    } else {
      put(kUnknownJson);
    }
  }
  // Seconds with microseconds; fixed decimals would be limited by the double's last digits.
  void time(std::int64_t time_ns) {
    if (time_ns < 0 && time_ns > -kNanosecondsPerSecond) put("-");
    end_ = put_integer(end_, time_ns / kNanosecondsPerSecond);
    char* digit = end_ + 7;
    for (std::int64_t rest = std::abs(time_ns % kNanosecondsPerSecond) / 1000; digit > end_ + 1; rest /= 10) {
      *--digit = static_cast<char>('0' + rest % 10);
    }
    *end_ = '.';
    end_ += 7;
  }
  void quality(std::uint32_t quality) { end_ = put_quality(end_, quality); }
  char* end() const { return end_; }

 private:
  char* end_;
};

// Appends to an object that is already closed; sensor names need no escaping.
void append_sensors(std::string& text, const SecondMean& second_mean) {
  if (!second_mean.sensor_list) return;
  text.back() = ',';
  text += "\"sensors\":{";
  for (std::size_t i = 0; i < second_mean.sensor_list->size(); ++i) {
    if (i > 0) text += ',';
    text += '"' + (*second_mean.sensor_list)[i].name + "\":";
    const double value = i < second_mean.sensors.size() ? second_mean.sensors[i] : kUnknown;
    if (std::isfinite(value)) {
      append_fixed(text, value, kSensorDecimals);
    } else {
      text += "null";
    }
  }
  text += "}}";
}

}  // namespace

void append_json(std::string& text, const Compensated& row) {
  char json[most_sample_chars()];
  JsonWriter line(json);
  line.put(kTimeKey);
  line.time(row.sample.time_ns);
  [&]<std::size_t... i>(std::index_sequence<i...>) { (line.member(kSampleMembers[i], row), ...); }
  (std::make_index_sequence<kSampleMembers.size()>());
  line.put(kQualityKey);
  line.quality(row.correction.quality);
  line.put(kSampleEnd);
  text.append(json, static_cast<std::size_t>(line.end() - json));
}

void append_json(std::string& text, const CompensatedWindow& row) {
  for (const std::size_t i : kJsonColumns) {
    const LogColumn& column = kLogColumns[i];
    const bool quoted = column.type == ColumnType::kText;
    text += column.json == 1 ? "{\"" : ",\"";
    (text += column.name) += quoted ? "\":\"" : "\":";
    const std::size_t begin = text.size();
    column.append(text, row);
    if (text.size() == begin) text += kUnknownJson;
    if (quoted) text += '"';
  }
  text += '}';
  append_sensors(text, row.window.second_mean);
}

}  // namespace prism::compensation
