// SPDX-License-Identifier: MIT
#include "config/axis_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "compensation/earth_rate.hpp"
#include "config/search_path.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

void read_mounting(const Section& section, AxisConfig& axis) {
  const auto sign = section.integer("sign", {-1, 1}, static_cast<std::int64_t>(axis.sign));
  if (sign == 0) section.fail("sign", "found 0, expected 1 or -1");
  axis.sign = static_cast<double>(sign);
  if (section.has("scale_factor_arcsec_per_pulse"))
    axis.scale_factor_arcsec_per_pulse = section.number("scale_factor_arcsec_per_pulse", {1e-9, 1e6});
}

void read_direction(const Section& section, AxisConfig& axis) {
  if (section.has("elevation_deg")) axis.elevation_deg = section.number("elevation_deg", {-90, 90});
  axis.azimuth_stated = section.has("azimuth_deg");
  axis.azimuth_deg = section.number("azimuth_deg", {-360, 360}, axis.azimuth_deg);
}

void read_slew(const Section& correction, compensation::SlewSettings& slew) {
  slew.limited = correction.boolean("slew_limit", slew.limited);
  if (!correction.has("max_slew_deg_per_h_per_s")) return;
  if (!slew.limited) correction.fail("max_slew_deg_per_h_per_s", "given although \"slew_limit\" is false");
  slew.max_slew_deg_per_h_per_s = correction.number("max_slew_deg_per_h_per_s", {1e-9, 1e6});
}

// Value "blend" of version 0.1.
compensation::Extrapolation read_extrapolation(const Section& correction, compensation::Extrapolation otherwise,
                                               std::vector<std::string>& warnings) {
  constexpr auto& kNames = compensation::kExtrapolationNames;
  std::vector<const char*> names(kNames.begin(), kNames.end());
  names.push_back("blend");
  const std::size_t chosen = correction.choice("extrapolation", names, static_cast<std::size_t>(otherwise));
  if (chosen < kNames.size()) return static_cast<compensation::Extrapolation>(chosen);
  warnings.push_back(correction.where() +
                     "/extrapolation: \"blend\" was removed because it made real gyros worse; using \"shrink\"");
  return compensation::Extrapolation::kShrink;
}

void read_models(const Section& section, const fs::path& base, AxisConfig& axis) {
  if (const std::string model = section.text("model", ""); !model.empty())
    axis.model = find_data_file(model, "models", base);
  if (const std::string model = section.text("fallback_model", ""); !model.empty())
    axis.fallback_model = find_data_file(model, "models", base);
}

void read_correction(const Section& correction, AxisConfig& axis, std::vector<std::string>& warnings) {
  compensation::CompensationSettings& engine = axis.engine;
  engine.max_bias_deg_per_h = correction.number("max_bias_deg_per_h", {1e-6, 1e6}, engine.max_bias_deg_per_h);
  engine.extrapolation = read_extrapolation(correction, engine.extrapolation, warnings);
  read_slew(correction, engine.slew);
}

/// Keys of a single axis are not allowed at the top level if "axes" is given.
void refuse_both_forms(const Section& top) {
  const auto refuse = [](const Section& section, std::initializer_list<const char*> keys) {
    for (const char* key : keys) {
      if (section.has(key)) section.fail(key, "given together with \"axes\"; expected it in each axis of \"axes\"");
    }
  };
  refuse(top, {"model", "fallback_model", "correction"});
  refuse(top.object("gyro"), {"axis", "sign", "scale_factor_arcsec_per_pulse"});
  refuse(top.object("site"), {"elevation_deg", "azimuth_deg"});
}

/// Of an axis that is not vertical.
void warn_of_azimuth(Config& config) {
  for (const AxisConfig& axis : config.axes) {
    if (!axis.elevation_deg || axis.azimuth_stated) continue;
    const double range = compensation::azimuth_range_deg_per_h({config.latitude_deg, *axis.elevation_deg, 0});
    if (range < compensation::kAzimuthMatters) continue;
    config.warnings.push_back(
        fmt::format("azimuth_deg{} is not stated: north (0) is assumed; the Earth rate on this axis depends on it by "
                    "up to {:.3g} deg/h",
                    axis.name.empty() ? "" : " of axis " + axis.name, range));
  }
}

}  // namespace

void read_axes(const Section& top, const fs::path& base, Config& config) {
  config.by_axes = top.has("axes");
  if (!config.by_axes) {
    AxisConfig& axis = config.axes.emplace_back();
    if (const Section gyro = top.object("gyro"); gyro.has("axis"))
      axis.name = gyro.text("axis", {}, TextRule::kAxisName);
    read_mounting(top.object("gyro"), axis);
    read_direction(top.object("site"), axis);
    read_models(top, base, axis);
    read_correction(top.object("correction"), axis, config.warnings);
    return warn_of_azimuth(config);
  }
  refuse_both_forms(top);
  const Section axes = top.object("axes");
  for (const std::string& name : axes.names(TextRule::kAxisName)) {
    const Section section = axes.object(name);
    AxisConfig& axis = config.axes.emplace_back();
    axis.name = name;
    if (section.has("temperature")) axis.thermometer = section.text("temperature", {}, TextRule::kSensorName);
    if (section.has("uhfo")) axis.uhfo = section.text("uhfo", {}, TextRule::kSensorName);
    read_mounting(section, axis);
    read_direction(section, axis);
    read_models(section, base, axis);
    read_correction(section.object("correction"), axis, config.warnings);
  }
  if (config.axes.empty()) top.fail("axes", "found none, expected at least one axis");
  warn_of_azimuth(config);
}

}  // namespace prism::config
