// SPDX-License-Identifier: MIT
// Makes repaired copies of logs, captures, models, frame descriptions and configurations.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/log_segment.hpp"

namespace prism::verification {

/// The result of repair().
struct Repaired {
  std::size_t rows = 0, segments = 0, captures = 0, documents = 0;  ///< numbers in the copy
  std::vector<recordings::LeftOutRow> left_out;                     ///< rows, packets and entire files (line 0)
};

/// Copies prism's files at `path` (a file, or a folder with all below it) into the new folder `out`, and verifies the
/// copy. Intact files are copied unchanged. Of damaged ones, all complete rows and packets are copied once; log
/// segments get a valid end line and a line "# repaired: …" with the damage. Logs get a new index. `path` is not
/// changed. Errors: `out` is within `path`, exists and is not empty, or cannot be written; logs of several gyros in one
/// folder; no file can be copied.
Result<Repaired> repair(const std::string& path, const std::string& out);

}  // namespace prism::verification
