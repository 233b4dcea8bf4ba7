// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/recording_options.hpp"

#include "tools/command_line.hpp"

namespace prism::commands {

void add_source_options(CLI::App& command, recordings::SourceOptions& options) {
  command
      .add_option("--map", options.map,
                  "any CSV: QUANTITY=COLUMN:UNIT[*SCALE][+OFFSET] for rate, temperature, uhfo, time; repeat or list")
      ->delimiter(',');
  command.add_option("--interval", options.interval_s, "seconds between rows, where a mapped CSV has no time")
      ->check(tools::positive());
  command.add_option("--config", options.config, "captures: the prismd.json they were recorded with");
  command.add_option("--axis", options.axis, "of recordings of several axes: the one that is meant");
}

void add_site_options(CLI::App& command, recordings::SiteOptions& options) {
  command.add_option("--latitude", options.latitude_deg, "of the place, deg; else what the log states")
      ->check(tools::within(-90, 90));
  command.add_option("--elevation", options.elevation_deg, "of the input axis above the horizon, deg")
      ->check(tools::within(-90, 90));
  command.add_option("--azimuth", options.azimuth_deg, "of the input axis from north over east, deg")
      ->check(tools::within(-360, 360));
  command.add_flag("--no-earth-rate", options.no_earth_rate,
                   "take no earth rate off: means are then offsets, sigmas stay");
}

void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& o) {
  add_source_options(command, o.source);
  add_site_options(command, o.site);
  command.add_option("--window", o.features.length_s, "seconds of the means and of the slope")
      ->check(tools::within(1, 3600))
      ->capture_default_str();
  command.add_option("--slope", o.slope, "difference (the paper) or least_squares")
      ->check(CLI::IsMember({"difference", "least_squares"}))
      ->capture_default_str();
  command.add_option("--end-mean", o.features.end_mean_s, "seconds averaged at each end of a difference")
      ->check(tools::within(1, 3600))
      ->capture_default_str();
  command.add_option("--max-gap", o.features.max_gap_s, "seconds of a hole that empties the window")
      ->check(tools::within(0, 3600))
      ->capture_default_str();
  command.add_option("--lag", o.features.lag_time_constants_s, "time constants of lag1, lag2, …, s")
      ->delimiter(',')
      ->check(tools::within(1, 1e7));
  command.add_option("--hold-out", o.hold_out,
                     "judge on a part that is not trained on: 0.5 (the last half of each recording) or blocks:600 "
                     "(every second 600 s)");
}

}  // namespace prism::commands
