// SPDX-License-Identifier: MIT
// CSV file next to the capture with the simulated gyro's state and true bias once per second.
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

/// `#` lines that describe the simulation, column names, and a row for each full second of the stream's time: time_utc
/// and time_s are those of the log, so that the files can be compared.
class TruthFile {
 public:
  /// Creates or replaces the file. Errors: it cannot be created.
  static Result<TruthFile> open(const std::string& path, const simulation::SimulationSettings& settings,
                                std::size_t axis = 0);

  /// Writes a row if a second has ended since the last call. `time_ns`: since 1970 UTC.
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

/// One file per axis; with several axes, PATH-AXIS with the path's extension.
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
