// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/unit_check.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tools/prismcal/tables/units.hpp"

namespace prism::recordings {
namespace {

constexpr double kLeastEarthRate = 0.5;       // deg/h
constexpr double kGreatestAtRest = 5 * 3600;  // deg/h; values of deg/h that are taken for deg/s have more
constexpr double kTolerance = 0.3;            // of the Earth rate: the bias of a gyro that detects it

}  // namespace

double mean_rate_deg_per_h(const BlockTable& table) {
  double sum = 0;
  std::size_t count = 0;
  for (const double bias : table.bias_deg_per_h) {
    if (!std::isfinite(bias)) continue;
    sum += bias;
    ++count;
  }
  return sum / static_cast<double>(count) + table.earth_rate_deg_per_h;
}

std::optional<std::string> likely_unit(double mean_deg_per_h, double earth_rate_deg_per_h) {
  const double earth = earth_rate_deg_per_h;
  const auto is_earth = [earth](double rate) { return std::abs(rate - earth) < kTolerance * std::abs(earth); };
  if (std::abs(earth) < kLeastEarthRate || is_earth(mean_deg_per_h)) return std::nullopt;
  for (const tables::Unit& unit : tables::kUnits) {
    if (unit.quantity != "rate" || unit.factor == 1) continue;
    if (is_earth(mean_deg_per_h * unit.factor)) return std::string(unit.name);
    if (is_earth(mean_deg_per_h / unit.factor)) return "deg/h";
  }
  return std::nullopt;
}

std::string sign_question(const BlockTable& table) {
  constexpr double kNear = 0.1;  // of the Earth rate: chance hardly leads a large bias there
  const double earth = table.earth_rate_deg_per_h, mean = mean_rate_deg_per_h(table);
  if (std::abs(earth) < kLeastEarthRate || !(std::abs(mean + earth) < kNear * std::abs(earth))) return {};
  return fmt::format(
      "the mean rate is {:.3g} deg/h, the site's Earth rate {:.3g} deg/h: has the rate or the elevation the wrong "
      "sign?",
      mean, earth);
}

Result<BlockTable> with_plausible_unit(Result<BlockTable> table, const SiteOptions& options) {
  if (!table || options.accept_unit) return table;
  const double mean = mean_rate_deg_per_h(*table);
  const auto unit = likely_unit(mean, table->earth_rate_deg_per_h);
  if (!unit && !(std::abs(mean) >= kGreatestAtRest)) return table;
  if (!unit)
    return make_error(table->name,
                      fmt::format("the mean rate is {:.3g} deg/s, expected a gyro at rest (below 5 deg/s); are the "
                                  "values in deg/h? The unit is in --map or the frame description; --accept-unit",
                                  mean / 3600));
  return make_error(
      table->name,
      fmt::format("the mean rate is {:.3g} deg/h, but the site's Earth rate {:.3g} deg/h if the values are "
                  "in {}; expected the unit {} in --map or the frame description, or --accept-unit",
                  mean, table->earth_rate_deg_per_h, *unit, *unit));
}

}  // namespace prism::recordings
