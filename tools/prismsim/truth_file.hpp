// SPDX-License-Identifier: MIT
// What no real gyro tells, beside the capture: the simulated gyro's state and true bias, once a second, as CSV.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "base/result.hpp"
#include "tools/prismsim/simulation/simulated_line.hpp"

namespace prism::prismsim {

/// `#` lines that say what was simulated, a line of column names, and a row for each whole second of the stream's time:
/// time_utc and time_s are those of the log, so that the two files can be laid side by side.
class TruthFile {
 public:
  /// Refused where the file cannot be created. One that is there is replaced.
  static Result<TruthFile> open(const std::string& path, const simulation::SimulationSettings& settings,
                                std::size_t axis = 0);

  /// Writes a row where a second has ended since the last call. `time_ns`: since 1970 UTC.
  Result<void> push(std::int64_t time_ns, const simulation::GyroTruth& truth);
  Result<void> flush();

 private:
  TruthFile(std::string path, Stream file);
  Result<void> refuse_write() const;

  std::string path_, row_;
  Stream file_;
  std::int64_t last_second_ = 0;
  bool begun_ = false;
};

/// One for each axis: where there are several, PATH-AXIS with the path's extension.
class TruthFiles {
 public:
  static Result<TruthFiles> open(const std::string& path, const simulation::SimulationSettings& settings,
                                 const wire::FrameDescription& frames);

  Result<void> push(std::int64_t time_ns, const simulation::SimulatedLine& line);
  Result<void> flush();

 private:
  std::vector<TruthFile> files_;
};

}  // namespace prism::prismsim
