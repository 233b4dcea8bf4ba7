// SPDX-License-Identifier: MIT
// Judges the rows of a table before they are used: implausible cells.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/plausibility.hpp"
#include "tools/prismcal/recordings/second_judge.hpp"

namespace prism::recordings {

/// A temperature in degC that is probably one in kelvin.
inline bool like_kelvin(double degc) { return degc > 230 && degc < 375; }

/// Call push() with each row in order of time, then finish().
class TableJudge {
 public:
  TableJudge();

  /// Returns the implausible quantities of the sample, by the same limits as for a line, and counts them.
  QuantitySet push(const Sample& sample, std::size_t line);
  /// Notes on what was left out, without the values in the explained seconds. Errors: more than 1 % of a quantity is
  /// implausible.
  Result<std::vector<std::string>> finish(const std::string& path, const JudgedSeconds& seconds) const;

 private:
  /// Values of one second that were rejected for one reason.
  struct Rejected {
    std::int64_t second = 0;
    std::size_t values = 0, first_line = 0;
    compensation::Rejection why;  ///< of the first
  };
  struct Count {
    std::size_t values = 0, like_kelvin = 0;
    std::vector<Rejected> rejected;
  };
  Result<std::string> implausible_text(std::size_t quantity, const std::vector<SecondRange>& explained,
                                       const std::string& path) const;

  compensation::Plausibility plausibility_;
  std::array<Count, 3> counts_;
};

}  // namespace prism::recordings
