// SPDX-License-Identifier: MIT
// Checks the segment indexes of a folder.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "daemon/pipeline/segment_index.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

/// All NAME.csv.index (or .pcap.index) files of a folder.
class Indexes {
 public:
  /// `extension`: of the segments, with the dot.
  Indexes(const std::string& folder, const std::string& extension);

  /// Position of a segment in the order of creation, from 1; 0: not in any index.
  std::uint64_t number(const std::string& file) const;
  /// Name of the first valid index file; empty: none.
  const std::string& file() const { return file_; }
  /// Adds findings for damaged indexes, deletions by retention, missing segments, and segments with fewer rows than in
  /// the index. `rows`: number of rows by file name, if known.
  void check(const std::map<std::string, std::uint64_t>& rows, std::vector<Finding>& findings) const;

 private:
  std::string folder_, file_;
  std::vector<pipeline::SegmentIndex> read_;
  std::vector<std::string> damaged_;
  std::vector<Finding> deletions_;
};

}  // namespace prism::verification
