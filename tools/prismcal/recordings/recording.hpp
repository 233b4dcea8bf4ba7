// SPDX-License-Identifier: MIT
// prismd's log as a recording: one file, or a folder of segments, with what its metadata says.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "compensation/averager.hpp"
#include "compensation/earth_rate.hpp"
#include "compensation/result.hpp"

namespace prism::recordings {

struct SourceFile {
  std::string path, sha256;
  std::size_t rows = 0;
};

struct Recording {
  std::string name;  ///< file or folder without its way and ending
  std::vector<SourceFile> files;
  std::map<std::string, std::string> metadata;  ///< "# key: value" lines; of several files, the first that has the key
  std::vector<compensation::Bucket> buckets;    ///< in order of time

  std::string value(const std::string& key) const;  ///< empty where the log does not say
};

/// Reads a log file of prismd, or every *.csv of a folder in the order of their names. Refused with file and line: what
/// is not such a log, a row that is damaged, a folder without one.
Result<Recording> read_recording(const std::string& path);

/// The axis placement that the log's "site" line states; nothing else is known of it.
Result<compensation::AxisPlacement> site_of(const Recording& recording);

}  // namespace prism::recordings
