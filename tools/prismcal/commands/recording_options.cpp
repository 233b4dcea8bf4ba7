// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/recording_options.hpp"

#include "tools/command_line.hpp"

namespace prism::commands {

void add_source_options(CLI::App& command, recordings::SourceOptions& options) {
  command
      .add_option("--map", options.map,
                  "any CSV: QUANTITY=COLUMN:UNIT[*SCALE][+OFFSET] for rate, temperature, uhfo, time; repeat or list")
      ->delimiter(',');
  command.add_option("--interval", options.interval_s, "seconds between rows, if a mapped CSV has no time")
      ->check(tools::positive());
  command.add_option("--config", options.config, "captures: configuration of the prismd that recorded them");
  command.add_option("--axis", options.axis, "axis to use, if the recording has several");
}

void add_site_options(CLI::App& command, recordings::SiteOptions& options) {
  command.add_option("--latitude", options.latitude_deg, "site latitude, deg (default: from the log)")
      ->check(tools::within(-90, 90));
  command.add_option("--elevation", options.elevation_deg, "elevation of the input axis above the horizon, deg")
      ->check(tools::within(-90, 90));
  command.add_option("--azimuth", options.azimuth_deg, "azimuth of the input axis from north towards east, deg")
      ->check(tools::within(-360, 360));
  command.add_flag("--no-earth-rate", options.no_earth_rate,
                   "do not subtract the Earth rate: means become offsets, sigmas do not change");
}

void add_training_set_options(CLI::App& command, recordings::TrainingSetOptions& o) {
  add_source_options(command, o.source);
  add_site_options(command, o.site);
  command.add_option("--window", o.features.length_s, "window of the means and the slope, s")
      ->check(tools::within(1, 3600))
      ->capture_default_str();
  command.add_option("--slope", o.slope, "difference (the paper) or least_squares")
      ->check(CLI::IsMember({"difference", "least_squares"}))
      ->capture_default_str();
  command.add_option("--end-mean", o.features.end_mean_s, "seconds averaged at each end for --slope difference")
      ->check(tools::within(1, 3600))
      ->capture_default_str();
  command.add_option("--max-gap", o.features.max_gap_s, "longest gap in a window, s; a longer one restarts it")
      ->check(tools::within(0, 3600))
      ->capture_default_str();
  command.add_option("--lag", o.features.lag_time_constants_s, "time constants of lag1, lag2, …, s")
      ->delimiter(',')
      ->check(tools::within(1, 1e7));
  command.add_option("--hold-out", o.hold_out,
                     "evaluate on a part not used for training: 0.5 (the last half of each recording) or blocks:600 "
                     "(every second 600 s)");
}

}  // namespace prism::commands
