// SPDX-License-Identifier: MIT
// A recording: one-second means from a log of prismd, a capture, or any CSV with mapped columns.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/second_averager.hpp"
#include "tools/prismcal/tables/table_options.hpp"

namespace prism::recordings {

struct SourceFile {
  std::string path, sha256;
  std::size_t rows = 0;
};

struct Recording {
  std::string name;  ///< name of the file or folder, without directory and extension
  std::vector<SourceFile> files;
  std::map<std::string, std::string> metadata;         ///< "# key: value" lines; the first file with the key wins
  std::vector<compensation::SecondMean> second_means;  ///< in order; seconds increase within a session
  std::vector<std::size_t> sessions;   ///< index of the first second of each session; empty: one session
  std::vector<std::string> notes;      ///< readable lines on data left out
  std::vector<std::string> deletions;  ///< those of them on segments that retention deleted

  std::string value(const std::string& key) const;  ///< metadata value; empty: none
  /// Sensors whose values the seconds contain; empty if there are no seconds.
  std::vector<SensorName> sensors() const;
  void add_metadata(const std::string& lines);  ///< adds "# key: value" lines; ignores other lines
};

struct SourceOptions {
  /// "rate=COLUMN:UNIT", "temperature=…", "uhfo=…", "time=…". COLUMN: name or number from 1. UNIT: see
  /// ../tables/units.hpp, else by the header; "rate=Gx:deg/s*0.061-1.2" scales and shifts a column to its unit. Empty:
  /// not a mapped CSV.
  std::vector<std::string> map;
  tables::TableOptions table;  ///< how a mapped table is written; its interval_s: spacing of rows without a time, > 0
  bool judged = true;          ///< mapped table: implausible values and single outliers are left out (table_judge.hpp)
  std::string config;          ///< capture: configuration of the prismd that recorded it
  std::string axis;            ///< selects one axis of a log or capture with several
};

struct SiteOptions {
  std::optional<double> latitude_deg, elevation_deg, azimuth_deg;  ///< override the site in the recording
  bool no_earth_rate = false;
};

/// Reads a mapped CSV if options.map is not empty, else a capture or a log by the first bytes of the file.
Result<Recording> read_recording(const std::string& path, const SourceOptions& options);

/// Returns the axes to choose from: those in the headers of the logs, or those in the configuration of a capture. Reads
/// no rows.
Result<std::vector<std::string>> axes_of(const std::string& path, const SourceOptions& options);

/// Returns the Earth rate on the axis by the options or the recording's "site", deg/h; 0 with --no-earth-rate. Errors:
/// no site in either.
Result<double> earth_rate_of(const Recording& recording, const SiteOptions& options);

std::vector<std::string> axes_of_log(const std::string& path);
Result<std::vector<std::string>> axes_of_capture(const SourceOptions& options);

// The readers, one source file each.
/// Reads a log file of prismd, or all *.csv of a folder. Errors: those of LogFolder::read().
Result<Recording> read_log(const std::string& path, const std::string& axis = {});
/// Returns true if the first bytes are those of pcap or pcapng.
bool is_capture(const std::string& path);
Result<Recording> read_capture(const std::string& path, const SourceOptions& options);
/// Averages the rows to seconds with SecondAverager, as prismd does.
Result<Recording> read_mapped(const std::string& path, const SourceOptions& options);

}  // namespace prism::recordings
