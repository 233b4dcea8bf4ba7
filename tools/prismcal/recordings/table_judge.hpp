// SPDX-License-Identifier: MIT
// Judges the values of a table before they are used: implausible cells, outliers, constant sensors, repeated rows.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

/// Call push() with each row in order of time.
class TableJudge {
 public:
  TableJudge();

  /// Returns the implausible quantities of the sample, by the same limits as for a line, and counts them.
  QuantitySet push(const Sample& sample, std::size_t line);
  /// Notes on what was left out. Errors: more than 1 % of a quantity is implausible.
  Result<std::vector<std::string>> finish(const std::string& path) const;

 private:
  struct Count {
    std::size_t values = 0, implausible = 0, first_line = 0, like_kelvin = 0;
    std::string why;
  };
  compensation::Plausibility plausibility_;
  std::array<Count, 3> counts_;
  std::size_t repeated_ = 0, first_repeated_line_ = 0;
  Sample last_;
  bool any_ = false;
};

/// Makes seconds unknown whose rate is far from all others (more than 50 times the noise away: single ones and blocks
/// of at most 600 s and 5 % of the record; five blocks, or any number with one value, which is a code for "no value"),
/// and names them and a thermometer that stays constant while the rate moves. Returns the notes.
std::vector<std::string> judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date);

}  // namespace prism::recordings
