// SPDX-License-Identifier: MIT
// What every command that reads recordings asks about them: where they come from, and where the gyro stood.
#pragma once

#include <CLI/App.hpp>
#include <optional>

#include "tools/prismcal/recordings/source.hpp"

namespace prism::recordings {

struct PlaceOptions {
  std::optional<double> latitude_deg, elevation_deg, azimuth_deg;  ///< instead of what the log states
  bool no_earth_rate = false;
};

/// --map, --interval, --config.
void add_source_options(CLI::App& command, SourceOptions& options);
/// --latitude, --elevation, --azimuth, --no-earth-rate.
void add_place_options(CLI::App& command, PlaceOptions& options);

/// The earth rate of a recording by the options or its log, deg/h; 0 with --no-earth-rate.
Result<double> earth_rate_of(const Recording& recording, const PlaceOptions& options);

}  // namespace prism::recordings
