// SPDX-License-Identifier: MIT
// Finds jumps of a recording's temperature that stay: faults of the thermometer, or true.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compensation/plausibility.hpp"
#include "compensation/second_averager.hpp"

namespace prism::recordings {

/// From one-second means, as prismd reports of its line (daemon/pipeline/stream_watch.hpp).
class JumpFinder {
 public:
  /// Call with each second in order.
  void push(const compensation::SecondMean& second_mean, bool begins_session);
  /// One line per jump, with the --leave-out that leaves it out. `is_date`: as end_of_second().
  std::vector<std::string> questions(bool is_date) const;

 private:
  struct Jump {
    compensation::JumpWatch::Jump values;
    std::int64_t from = 0;           ///< its first second
    std::optional<std::int64_t> to;  ///< the last second before it had jumped back
  };
  compensation::JumpWatch watch_;
  double last_degc_ = kUnknown;        ///< plausible
  std::int64_t from_ = 0, until_ = 0;  ///< seconds that are rejected
  std::vector<Jump> jumps_;
};

}  // namespace prism::recordings
