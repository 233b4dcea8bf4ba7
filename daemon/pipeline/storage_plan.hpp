// SPDX-License-Identifier: MIT
// How long the log and the capture will be kept, and how large they get, before any data were written.
#pragma once

#include <optional>
#include <string>

#include "daemon/pipeline/setup.hpp"

namespace prism::pipeline {

/// Which limit of a log or capture acts first, from the described frame rate and lengths.
struct StoragePlan {
  double days;             ///< kept
  double bytes;            ///< size that it reaches
  double frames_per_s;     ///< 0: not of frames
  std::int64_t keep_days;  ///< as configured; above `days`: keep_mib acts first

  /// "12.6 days at 200 frames/s, 10.0 GiB (keep_mib, before keep_days 30)"
  std::string text() const;
};

/// nullopt: not configured.
std::optional<StoragePlan> log_plan(const Setup& setup);
std::optional<StoragePlan> capture_plan(const Setup& setup);

/// Why the service would not be able to write to `directory`, as far as this user can tell without writing; "" if
/// nothing speaks against it. Asks the file system; may wait for it.
std::string directory_problem(const std::string& directory);

/// Reads the free space of the file system; may wait for it. Empty if the plan fits, or if the space is not known.
std::string space_warning(const StoragePlan& plan, const std::string& directory);

}  // namespace prism::pipeline
