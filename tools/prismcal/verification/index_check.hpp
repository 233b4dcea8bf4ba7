// SPDX-License-Identifier: MIT
// Checks the indexes of the segments of a folder.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "daemon/pipeline/segment_index.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

/// Every NAME.csv.index (or .pcap.index) of a folder.
class Indexes {
 public:
  /// `extension` of the segments, with its dot.
  Indexes(const std::string& folder, const std::string& extension);

  /// In the order of making; 0: no index knows it.
  std::uint64_t number(const std::string& file) const;
  /// Path of the first one; empty if there is none.
  const std::string& file() const { return file_; }
  /// Damaged indexes, segments that are not there, and such that hold fewer rows than they had at their end. `rows`: of
  /// those that are there and whose rows are known, by the name of the file.
  void check(const std::map<std::string, std::uint64_t>& rows, std::vector<Finding>& findings) const;

 private:
  std::string folder_, file_;
  std::vector<pipeline::SegmentIndex> read_;
  std::vector<std::string> damaged_;
};

}  // namespace prism::verification
