// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/time_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>

#include "base/escape.hpp"
#include "tools/prismcal/tables/cell.hpp"

namespace prism::tables {
namespace {

constexpr double kNs = 1e9;
constexpr std::int64_t kDay_ns = 86400LL * 1'000'000'000;
constexpr double kExcelEpoch_days = 25569, kDatenumEpoch_days = 719529;
constexpr double kLabviewEpoch_s = 2082844800;
constexpr double kGpsEpoch_s = 315964800;
constexpr std::int64_t kFiletimeEpoch_s = 11644473600, kDotNetEpoch_s = 62135596800;

/// Nanoseconds of days; whole days and the rest separately, for all digits of a double.
std::int64_t days_to_ns(double days) {
  const double whole = std::floor(days);
  return static_cast<std::int64_t>(whole) * kDay_ns + std::llround((days - whole) * 86400e9);
}

std::int64_t seconds_to_ns(double value, double unit_s) {
  if (unit_s == 1e-9) return std::llround(value);
  const double seconds = value * unit_s;
  if (std::fabs(seconds) < 1e7) return std::llround(seconds * kNs);
  const double whole = std::floor(seconds);
  return static_cast<std::int64_t>(whole) * 1'000'000'000 + std::llround((seconds - whole) * kNs);
}

/// The middle step of the sample; 0 if all values are equal.
double step_of(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) steps.push_back(values[i] - values[i - 1]);
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  // With repeated stamps the mean is the step.
  const double mean = (values.back() - values.front()) / static_cast<double>(values.size() - 1);
  return mean > 0 && mean < *middle ? mean : *middle;
}

/// The value after 120059 if it is 120100: the digits of hours, minutes and seconds.
std::optional<double> minute_of_digits(const std::vector<double>& values) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] - values[i - 1] == 41 && std::fmod(values[i], 100) == 0 && values[i] < 240000) return values[i];
  }
  return std::nullopt;
}

const Unit* time_unit(const std::string& name) { return find_unit("time", name); }

TimeFormat number_format(double unit_s, std::string text) {
  TimeFormat format;
  format.unit_s = unit_s;
  format.text = std::move(text);
  return format;
}

TimeFormat days_format(TimeKind kind, std::string text) {
  TimeFormat format;
  format.kind = kind;
  format.has_date = true;
  format.text = std::move(text);
  return format;
}

TimeFormat unix_format(double first) {
  TimeFormat format = days_format(TimeKind::kUnix, "Unix time in s");
  for (const auto& [name, unit_s] : {std::pair{"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}) {
    if (first * unit_s < 1e8) break;
    format.unit_s = unit_s;
    format.text = std::string("Unix time in ") + name;
  }
  return format;
}

/// 1998 to 2053 in ticks of 100 ns, which as nanoseconds are of 1974 and 1990.
std::optional<TimeFormat> ticks_format(double first) {
  const bool filetime = first >= 1.253e17 && first < 1.427e17;
  if (!filetime && !(first >= 6.303e17 && first < 6.477e17)) return std::nullopt;
  TimeFormat format = days_format(TimeKind::kUnix, filetime ? "Windows FILETIME" : ".NET ticks");
  format.unit_s = 1e-7;
  format.offset_s = -(filetime ? kFiletimeEpoch_s : kDotNetEpoch_s);
  return format;
}

Result<TimeFormat> stated_number(const std::string& name, double first, const Unit* unit) {
  if (name == "unix") {
    TimeFormat format = unix_format(first);
    if (unit) format.unit_s = unit->factor, format.text = fmt::format("Unix time in {}", unit->name);
    return format;
  }
  if (name == "excel") return days_format(TimeKind::kExcel, "Excel serial days");
  if (name == "datenum") return days_format(TimeKind::kDatenum, "MATLAB datenum");
  if (name == "labview") return days_format(TimeKind::kLabview, "LabVIEW seconds since 1904");
  if (name == "number")
    return number_format(unit ? unit->factor : 1, fmt::format("a number of {}", unit ? unit->name : "s"));
  return make_error("--time-format", fmt::format("found {}, but the time is a number", name));
}

bool within(double value, double low, double high) { return value >= low && value < high; }

/// Picks the unit with which the step is the stated interval.
const Unit* unit_by_interval(double step, double interval_s) {
  for (const char* name : {"s", "ms", "us", "ns", "min", "h", "d"}) {
    const Unit* unit = time_unit(name);
    if (std::fabs(step * unit->factor / interval_s - 1) < 0.3) return unit;
  }
  return nullptr;
}

/// Nanoseconds in 64 bits reach 292 years.
bool fits(double seconds) { return std::fabs(seconds) <= 9e9; }

}  // namespace

std::optional<std::int64_t> TimeFormat::from_number(double value, double other_cell) const {
  value = value * scale + offset;
  const auto of_days = [](double days) { return fits(days * 86400) ? std::optional(days_to_ns(days)) : std::nullopt; };
  const auto of_seconds = [](double number, double factor) {
    return fits(number * factor) ? std::optional(seconds_to_ns(number, factor)) : std::nullopt;
  };
  switch (kind) {
    case TimeKind::kExcel:
      return of_days(value - kExcelEpoch_days);
    case TimeKind::kDatenum:
      return of_days(value - kDatenumEpoch_days);
    case TimeKind::kLabview:
      return of_seconds(value - kLabviewEpoch_s, 1);
    case TimeKind::kGps: {
      const double week_s = kGpsEpoch_s + 604800 * std::trunc(value);
      const auto weeks = of_seconds(week_s, 1), rest = of_seconds(other_cell, 1);
      return weeks && rest && fits(week_s + other_cell) ? std::optional(*weeks + *rest) : std::nullopt;
    }
    default:
      return of_seconds(value + static_cast<double>(offset_s) / unit_s, unit_s);
  }
}

std::optional<std::int64_t> TimeFormat::parse(std::string_view cell, std::string_view other_cell) const {
  if (kind == TimeKind::kText) {
    const auto date = date_in(cell);
    if (!date || (date->order != DateOrder::kNone) != has_date) return std::nullopt;
    const auto ns = nanoseconds_of(*date, order);
    if (!ns || !second) return ns;
    const auto clock = date_in(other_cell);
    if (!clock || clock->order != DateOrder::kNone || !clock->has_time || date->has_time) return std::nullopt;
    return *ns + *nanoseconds_of(*clock, order);
  }
  if (kind == TimeKind::kUnix || kind == TimeKind::kNumber) {
    // All digits of an integer; a double has 256 ns in 2024.
    std::int64_t integer = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), integer);
    const auto unit_ns = static_cast<std::int64_t>(std::llround(unit_s * kNs));
    const bool read = error == std::errc() && end == cell.data() + cell.size() && scale == 1 && offset == 0;
    if (read && unit_ns > 0) {
      const std::int64_t most = std::int64_t{9'000'000'000'000'000'000} / unit_ns,
                         origin = -offset_s * (1'000'000'000 / unit_ns);
      if (integer >= origin - most && integer <= origin + most) return (integer - origin) * unit_ns;
    }
  }
  const auto value = number_in(cell, decimal);
  const auto more = second ? number_in(other_cell, decimal) : std::optional(0.0);
  return value && more ? from_number(*value, *more) : std::nullopt;
}

Result<TimeFormat> detect_number_time(const std::string& where, const Header& header, const std::vector<double>& values,
                                      const std::string& unit, const TableOptions& options) {
  if (values.empty()) return make_error(where, fmt::format("found no time in column {}", header.text));
  const double first = values.front(), step = step_of(values);
  const auto ambiguous = [&](const std::string& readings) {
    return make_error(where, fmt::format("column {}: two readings are possible: {}", header.text, readings));
  };
  const std::string& stated = !unit.empty() ? unit : options.time_unit;
  const Unit* found = !stated.empty() ? time_unit(stated) : nullptr;
  if (!stated.empty() && !found)
    return make_error("--time-unit", fmt::format("found \"{}\", expected s, ms, us, ns, min, h or d", stated));
  if (!options.time_format.empty()) return stated_number(options.time_format, first, found);
  if (!found && header.unit && header.unit->quantity == "time") found = header.unit;
  if (const auto minute = minute_of_digits(values); minute && stated.empty()) {
    return ambiguous(
        fmt::format("{:.0f} and {:.0f} are numbers, or hours, minutes and seconds; state --time-unit for the "
                    "first, write hh:mm:ss for the second",
                    *minute - 41, *minute));
  }
  if (found) return number_format(found->factor, fmt::format("a number of {}", found->name));
  if (const auto ticks = ticks_format(first)) return *ticks;
  // Years 1973 to 2034, in steps of an hour at most: 5e8, 1e9, … are nanoseconds since the start of a recording.
  constexpr double kMostStep_s = 3600;
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    if (within(first * unit_s, 1e8, 2.05e9) && step * unit_s <= kMostStep_s) return unix_format(first);
  }
  if (within(first, 2.9e9, 4.3e9) && step <= kMostStep_s)
    return days_format(TimeKind::kLabview, "LabVIEW seconds since 1904");
  if (options.interval_s > 0) {
    if (const Unit* by_step = unit_by_interval(step, options.interval_s))
      return number_format(by_step->factor, fmt::format("a number of {} (by --interval)", by_step->name));
  }
  const bool excel = within(first, 20000, 80000) && first != std::floor(first), datenum = within(first, 690000, 800000);
  if ((excel || datenum) && step > 0 && step < 1.0 / 86) {
    const char* days = excel ? "excel" : "datenum";
    if (step < 1e-4) return *stated_number(days, first, nullptr);
    return ambiguous(fmt::format(
        "{} with steps of {:.4g} s, or a number of s with steps of {:.4g} s; state --time-format {} or --time-unit s",
        excel ? "Excel serial days" : "MATLAB datenum", step * 86400, step, days));
  }
  if (step > 2) {
    return ambiguous(
        fmt::format("steps of {:.6g} are {:.6g} s, {:.6g} s if they are ms, {:.6g} s if us, {:.6g} s if "
                    "ns; state --time-unit or --interval",
                    step, step, step * 1e-3, step * 1e-6, step * 1e-9));
  }
  // No gyro has 50 000 samples per second.
  if (step > 0 && step < 2e-5) {
    return ambiguous(
        fmt::format("steps of {:.4g} are s, or days ({:.4g} s); state --time-unit or --interval", step, step * 86400));
  }
  if (header.text.ends_with(')') || header.text.ends_with(']')) {
    return ambiguous(
        fmt::format("its unit is not known, and steps of {:.4g} may be s; state --time-unit or "
                    "--interval",
                    step));
  }
  return number_format(1, "a number, taken for s");
}

}  // namespace prism::tables
