// SPDX-License-Identifier: MIT
// Where recordings come from: prismd's log, a capture, or any CSV whose columns are mapped by name and unit.
#pragma once

#include <string>
#include <vector>

#include "compensation/result.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::recordings {

struct SourceOptions {
  /// "rate=NAME:UNIT", "temperature=…", "uhfo=…", "time=…": rate in deg/h, deg/s, rad/s or arcsec/s; temperature in
  /// degC, K or degF; uhfo in V or mV; time in s, ms, us or ns. Empty: no mapped CSV.
  std::vector<std::string> map;
  double interval_s = 0;  ///< mapped CSV without a time column: seconds between rows, > 0
  std::string config;     ///< capture: the prismd.json that it was recorded with (its frames, axis, mounting and clock)
};

/// One of the three, told apart by the options and the file's first bytes. Rows of a mapped CSV become samples and go
/// through the same averager as live ones. Refused in one line, with file and line where there is one.
Result<Recording> read_source(const std::string& path, const SourceOptions& options);

/// The parts, one file each. is_capture: pcap or pcapng by its first bytes.
Result<Recording> read_mapped(const std::string& path, const SourceOptions& options);
bool is_capture(const std::string& path);
Result<Recording> read_capture(const std::string& path, const SourceOptions& options);

}  // namespace prism::recordings
