// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/source_options.hpp"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "compensation/earth_rate.hpp"
#include "tools/number_check.hpp"

namespace prism::recordings {

void add_source_options(CLI::App& command, SourceOptions& options) {
  command
      .add_option("--map", options.map,
                  "any CSV: QUANTITY=COLUMN:UNIT for rate, temperature, uhfo, time; repeat or list")
      ->delimiter(',');
  command.add_option("--interval", options.interval_s, "seconds between rows, where a mapped CSV has no time")
      ->check(tools::positive());
  command.add_option("--config", options.config, "captures: the prismd.json they were recorded with");
}

void add_place_options(CLI::App& command, PlaceOptions& options) {
  command.add_option("--latitude", options.latitude_deg, "of the place, deg (default: what the log states)")
      ->check(tools::within(-90, 90));
  command.add_option("--elevation", options.elevation_deg, "of the input axis above the horizon, deg")
      ->check(tools::within(-90, 90));
  command.add_option("--azimuth", options.azimuth_deg, "of the input axis from north over east, deg")
      ->check(tools::within(-360, 360));
  command.add_flag("--no-earth-rate", options.no_earth_rate,
                   "take no earth rate off: means are then offsets, sigmas stay");
}

Result<double> earth_rate_of(const Recording& recording, const PlaceOptions& options) {
  if (options.no_earth_rate) return 0.0;
  compensation::AxisPlacement placement;
  if (!options.latitude_deg || !options.elevation_deg) {
    const auto site = site_of(recording);
    if (!site) return tl::unexpected<Error>(site.error());
    placement = *site;
  }
  placement.latitude_deg = options.latitude_deg.value_or(placement.latitude_deg);
  placement.elevation_deg = options.elevation_deg.value_or(placement.elevation_deg);
  placement.azimuth_deg = options.azimuth_deg.value_or(placement.azimuth_deg);
  return compensation::earth_rate_deg_per_h(placement);
}

}  // namespace prism::recordings
