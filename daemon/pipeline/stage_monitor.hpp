// SPDX-License-Identifier: MIT
// Alarm for a stage of the pipeline that has input and no output: bytes → frames → samples → rates.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/alarm.hpp"
#include "daemon/pipeline/notice.hpp"
#include "daemon/pipeline/pipeline.hpp"

namespace prism::pipeline {

/// Totals since the pipeline was created.
struct StageCounts {
  std::uint64_t bytes = 0, frames = 0;
  std::uint64_t refused = 0;         ///< frames that a refuse rule rejects
  std::uint64_t single = 0;          ///< frames that no second one confirmed
  std::uint64_t repeated = 0;        ///< frames with the counter or time tag of the frame before
  std::uint64_t samples = 0;         ///< frames that gave a sample of at least one axis
  std::vector<std::uint64_t> rates;  ///< samples with a known rate, by axis
};
StageCounts counts_of(const Pipeline& pipeline);

class StageMonitor {
 public:
  static constexpr double kStarvedS = 10;

  /// Returns a notice ("100 lines in 10 s, no number for axis z, for example \"1,25\"") when a stage had at least 10
  /// inputs and no output for kStarvedS, and one when it has output again. Call at least once a second while data
  /// arrive; now_ns: arrival time.
  std::optional<Notice> push(const Pipeline& pipeline, std::int64_t now_ns);
  /// A new session: the time before it does not count.
  void begin() { stages_.clear(); }
  /// The problem that exists now; empty: none.
  const std::string& problem() const { return alarm_.problem(); }

 private:
  std::string problem_at(const Pipeline& pipeline, const StageCounts& counts, std::int64_t now_ns);

  struct Stage {
    std::int64_t since_ns = 0;  ///< when its output last grew
    StageCounts before;         ///< the counts at that time
  };

  std::vector<Stage> stages_;  ///< frames, samples, and the rates of each axis
  Alarm alarm_;
};

}  // namespace prism::pipeline
