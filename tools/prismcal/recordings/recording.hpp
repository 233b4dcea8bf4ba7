// SPDX-License-Identifier: MIT
// A recording: the seconds of a log of prismd, of a capture, or of any CSV whose columns are mapped by name and unit.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

struct SourceFile {
  std::string path, sha256;
  std::size_t rows = 0;
};

struct Recording {
  std::string name;  ///< file or folder without its path and ending
  std::vector<SourceFile> files;
  std::map<std::string, std::string> metadata;  ///< "# key: value" lines; of several files, the first that has the key
  std::vector<compensation::SecondMean> second_means;  ///< in order; within a session seconds only go forward
  std::vector<std::size_t> sessions;                   ///< where each session begins in `second_means`; empty: one
  std::vector<std::string> notes;                      ///< what was left out of it, for people

  std::string value(const std::string& key) const;  ///< empty where the recording does not say
  /// Whose values its seconds carry; none where it has no second.
  std::vector<SensorName> sensors() const;
  void add_metadata(const std::string& lines);  ///< "# key: value" lines; other lines are passed over
};

struct SourceOptions {
  /// "rate=COLUMN:UNIT", "temperature=…", "uhfo=…", "time=…", units.hpp has the units, a column is a name or a number
  /// from 1; "rate=Gx:deg/s*0.061-1.2" is for what must be scaled and shifted to be in the unit. Empty: no mapped CSV.
  std::vector<std::string> map;
  double interval_s = 0;  ///< mapped CSV without a time column: seconds between rows, > 0
  std::string config;     ///< capture: the prismd.json that it was recorded with
  std::string axis;       ///< of a log or capture of several axes: the one that is wanted
};

struct SiteOptions {
  std::optional<double> latitude_deg, elevation_deg, azimuth_deg;  ///< instead of what the recording states
  bool no_earth_rate = false;
};

/// One of the three, told apart by the options and the file's first bytes. Refused in one line, with file and line
/// where there is one.
Result<Recording> read_recording(const std::string& path, const SourceOptions& options);

/// The axes that can be asked for: those that the logs of a folder name, or that the configuration of a capture serves;
/// one or none of a file. Only heads are read.
Result<std::vector<std::string>> axes_of(const std::string& path, const SourceOptions& options);

/// The earth rate on the axis by the options or the recording's "site", deg/h; 0 with --no-earth-rate. Refused: neither
/// says where the gyro stood.
Result<double> earth_rate_of(const Recording& recording, const SiteOptions& options);

std::vector<std::string> axes_of_log(const std::string& path);
Result<std::vector<std::string>> axes_of_capture(const SourceOptions& options);

// The three, one file each.
/// A log file of prismd, or every *.csv of a folder (log_folder.hpp). Refused: what is not such a log, a row within
/// that is damaged, a folder without one.
Result<Recording> read_log(const std::string& path, const std::string& axis = {});
/// pcap or pcapng by its first bytes; other files and folders are none.
bool is_capture(const std::string& path);
Result<Recording> read_capture(const std::string& path, const SourceOptions& options);
/// Rows become samples and go through the averager that serves live.
Result<Recording> read_mapped(const std::string& path, const SourceOptions& options);

}  // namespace prism::recordings
