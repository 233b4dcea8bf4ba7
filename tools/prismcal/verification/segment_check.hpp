// SPDX-License-Identifier: MIT
// Finds what a folder lacks of its logs and captures, by the numbers of their segments.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "daemon/pipeline/stored_segments.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

/// A segment that was read.
struct NumberedSegment {
  std::string path;
  pipeline::LogPosition position;  ///< of a capture: `log` is its name, `first` is 1
  std::uint64_t rows = 0;
  std::int64_t begin_s = 0;  ///< 0: not known
};

/// Adds findings for segments that are missing, and for segments with fewer rows than the next one says. `folder`: has
/// the segments; `has_older`: some of 0.3 or older, too, which are before them.
void check_numbers(const std::string& folder, bool has_older, std::vector<NumberedSegment> segments,
                   std::vector<Finding>& findings);

/// The same for segments of 0.3 and older by their indexes, and damaged indexes. `extension`: of the segments, with the
/// dot; `rows`: number of rows by file name, if known.
void check_old_indexes(const std::string& folder, const std::string& extension,
                       const std::map<std::string, std::uint64_t>& rows, std::vector<Finding>& findings);

}  // namespace prism::verification
