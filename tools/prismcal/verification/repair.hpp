// SPDX-License-Identifier: MIT
// Clean copies of logs, captures and the documents in their folders.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/log_segment.hpp"

namespace prism::verification {

/// The result of repair().
struct Repaired {
  std::size_t rows = 0, segments = 0, captures = 0, documents = 0;  ///< in the copy
  std::vector<recordings::LeftOutRow> left_out;                     ///< rows, packets and whole files (line 0)
};

/// Copies what `path` (a file, or a folder with all below it) holds of prism's into the folder `out`, which is made:
/// whole files byte for byte; of the others their whole rows and packets, each once, in files that are closed as prismd
/// does and say in "# repaired: …" what was wrong. Logs get a new index. Then the copy is verified. Nothing at `path`
/// is changed. Errors: `out` is within `path`, or there and not empty, or cannot be written; logs of two gyros in one
/// folder; nothing in `path` can be copied.
Result<Repaired> repair(const std::string& path, const std::string& out);

}  // namespace prism::verification
