// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/rate_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <numbers>
#include <string_view>

#include "compensation/evaluation/statistics.hpp"

namespace prism::recordings {
namespace {

constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

std::string_view trimmed(std::string_view field) {
  while (!field.empty() && (field.front() == ' ' || field.front() == '"')) field.remove_prefix(1);
  while (!field.empty() && (field.back() == ' ' || field.back() == '"' || field.back() == '\r')) field.remove_suffix(1);
  return field;
}

/// An empty field is a hole; "nan" is what other programs write for one.
bool parse_number(std::string_view field, double& value) {
  field = trimmed(field);
  value = kHole;
  if (field.empty() || field == "nan" || field == "NaN") return true;
  if (field.front() == '+') field.remove_prefix(1);
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  return error == std::errc() && end == field.data() + field.size() && std::isfinite(value);
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(separator, begin);
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    if (end == std::string_view::npos) return fields;
    begin = end + 1;
  }
}

/// Field `index` of a line; false where the line is shorter.
bool pick(std::string_view line, char separator, std::size_t index, std::string_view& field) {
  const char* begin = line.data();
  const char* const end = begin + line.size();
  for (; index > 0; --index) {
    begin = static_cast<const char*>(std::memchr(begin, separator, static_cast<std::size_t>(end - begin)));
    if (!begin) return false;
    ++begin;
  }
  const void* stop = std::memchr(begin, separator, static_cast<std::size_t>(end - begin));
  field = {begin, static_cast<std::size_t>((stop ? static_cast<const char*>(stop) : end) - begin)};
  return true;
}

Result<double> unit_factor(const std::string& unit, const std::string& where) {
  if (unit == "deg/h" || unit == "arcsec/s") return 1.0;
  if (unit == "deg/s") return 3600.0;
  if (unit == "rad/s") return 3600.0 * 180 / std::numbers::pi;
  return refuse(where, fmt::format("unit \"{}\"; expected deg/h, deg/s, rad/s or arcsec/s", unit));
}

std::string unit_by_name(const std::string& column) {
  if (column.ends_with("_dps") || column.ends_with("_deg_per_s")) return "deg/s";
  if (column.ends_with("_rad_per_s") || column.ends_with("_rads")) return "rad/s";
  return "deg/h";
}

/// The layout of the file and what is taken from it.
struct Layout {
  char separator = ',';
  std::vector<std::string> names;  ///< "1", "2", … where the file names nothing
  bool named = false;
  std::size_t rate = 0;
  std::optional<std::size_t> time;
};

std::optional<std::size_t> find_column(const Layout& layout, const std::string& wanted) {
  for (std::size_t i = 0; i < layout.names.size(); ++i) {
    if (layout.names[i] == wanted || std::to_string(i + 1) == wanted) return i;
  }
  return std::nullopt;
}

Result<Layout> choose_columns(const std::string& first_line, const RateSeriesChoice& choice, const std::string& path) {
  Layout layout;
  for (const char separator : {'\t', ';', ','}) {
    if (first_line.find(separator) != std::string::npos) layout.separator = separator;
  }
  for (const std::string_view field : split(first_line, layout.separator)) {
    double number = 0;
    layout.named = layout.named || !parse_number(field, number);
    layout.names.emplace_back(field);
  }
  if (!layout.named) {
    for (std::size_t i = 0; i < layout.names.size(); ++i) layout.names[i] = std::to_string(i + 1);
  }
  const std::string all = fmt::format("{}", fmt::join(layout.names, ", "));
  if (!choice.time_column.empty()) {
    layout.time = find_column(layout, choice.time_column);
    if (!layout.time) return refuse(path, fmt::format("no column \"{}\"; found {}", choice.time_column, all));
  } else if (layout.named) {
    for (const char* name : {"t_s", "time_s"}) {
      if (const auto found = find_column(layout, name)) layout.time = found;
    }
  }
  auto rate = find_column(layout, choice.column.empty() ? "rate_deg_per_h" : choice.column);
  if (!rate && choice.column.empty() && layout.names.size() == 1) rate = 0;
  if (!rate && choice.column.empty() && layout.names.size() == 2 && layout.time) rate = 1 - *layout.time;
  if (!rate) {
    return refuse(path, choice.column.empty() ? fmt::format("which column is the rate? --column one of {}", all)
                                              : fmt::format("no column \"{}\"; found {}", choice.column, all));
  }
  layout.rate = *rate;
  return layout;
}

/// Rates and times as they stand in the file, line by line.
class Reader {
 public:
  Reader(const std::string& path, const RateSeriesChoice& choice) : path_(path), choice_(choice) {}

  Result<void> read() {
    std::ifstream in(path_, std::ios::binary);
    if (!in) return refuse(path_, "cannot be opened");
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty() || line[0] == '#') continue;
      if (!known_) {
        auto layout = choose_columns(line, choice_, path_);
        if (!layout) return tl::unexpected(layout.error());
        layout_ = std::move(*layout);
        known_ = true;
        if (layout_.named) continue;
      }
      if (const auto done = add(line, number); !done) return done;
    }
    if (rates_.empty()) return refuse(path_, "no row of numbers; expected a rate in every line");
    return {};
  }

  Result<void> add(std::string_view line, std::size_t number) {
    std::string_view field;
    double rate = kHole, time = 0;
    if (!pick(line, layout_.separator, layout_.rate, field) || !parse_number(field, rate)) {
      return refuse(fmt::format("{}:{}", path_, number),
                    fmt::format("column {} is \"{}\"; expected a number", layout_.names[layout_.rate], field));
    }
    rates_.push_back(rate);
    if (!layout_.time) return {};
    if (!pick(line, layout_.separator, *layout_.time, field) || !parse_number(field, time) || !std::isfinite(time)) {
      return refuse(fmt::format("{}:{}", path_, number), "no time; expected seconds");
    }
    if (!times_.empty() && !(time > times_.back())) {
      return refuse(fmt::format("{}:{}", path_, number),
                    fmt::format("time {} does not come after {}", time, times_.back()));
    }
    times_.push_back(time);
    return {};
  }

  std::string path_;
  RateSeriesChoice choice_;
  Layout layout_;
  bool known_ = false;
  std::vector<double> rates_, times_;
};

double median_step(const std::vector<double>& times) {
  std::vector<double> steps;
  steps.reserve(times.size());
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return evaluation::median_of(std::move(steps));
}

}  // namespace

Result<RateSeries> read_rate_series(const std::string& path, const RateSeriesChoice& choice) {
  Reader reader(path, choice);
  if (const auto done = reader.read(); !done) return tl::unexpected(done.error());
  RateSeries series;
  series.column = reader.layout_.names[reader.layout_.rate];
  series.unit = choice.unit.empty() ? unit_by_name(series.column) : choice.unit;
  const auto factor = unit_factor(series.unit, path);
  if (!factor) return tl::unexpected(factor.error());
  series.rows = reader.rates_.size();

  const bool timed = reader.times_.size() > 1;
  series.interval_s = choice.interval_s ? *choice.interval_s : timed ? median_step(reader.times_) : 1;
  series.interval_source = choice.interval_s ? "given"
                           : timed           ? "median step of " + reader.layout_.names[*reader.layout_.time]
                                             : "assumed: the file has no time";
  if (!(series.interval_s > 0))
    return refuse(path, fmt::format("interval {} s; expected more than 0", series.interval_s));
  series.rate_deg_per_h.reserve(series.rows);
  for (std::size_t i = 0; i < series.rows; ++i) {
    if (timed && i > 0 && reader.times_[i] - reader.times_[i - 1] > 1.5 * series.interval_s) {
      series.rate_deg_per_h.push_back(kHole);
    }
    series.rate_deg_per_h.push_back(reader.rates_[i] * *factor);
  }
  return series;
}

}  // namespace prism::recordings
