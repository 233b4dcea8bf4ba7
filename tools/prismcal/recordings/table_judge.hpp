// SPDX-License-Identifier: MIT
// Judges the values of a table before they are used: implausible cells, outliers, constant sensors, repeated rows.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/jump_watch.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

/// Call push() with each row in order of time.
class TableJudge {
 public:
  TableJudge();

  /// Makes implausible values of the sample unknown, by the same limits as for a line, and counts them.
  void push(Sample& sample, std::size_t line);
  /// Notes on what was left out, and on jumps that stay, which may be faults or true. Errors: more than 1 % of a
  /// quantity is implausible.
  Result<std::vector<std::string>> finish(const std::string& path) const;

 private:
  struct Count {
    std::size_t values = 0, implausible = 0, first_line = 0, like_kelvin = 0;
    std::string why;
    compensation::JumpWatch jump;
    std::size_t jump_line = 0;
    std::string question;  ///< the first jump that stayed
  };
  static void follow_jump(Count& count, std::size_t quantity, double value, bool bad,
                          const compensation::Rejection& why, std::size_t line);
  compensation::Plausibility plausibility_;
  std::array<Count, 3> counts_;
  std::size_t repeated_ = 0, first_repeated_line_ = 0;
  Sample last_;
  bool any_ = false;
};

/// Makes single seconds unknown whose rate is far from all others (at most five, each more than 50 times the noise
/// away), and names them and a thermometer that stays constant while the rate moves. Returns the notes.
std::vector<std::string> judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date);

}  // namespace prism::recordings
