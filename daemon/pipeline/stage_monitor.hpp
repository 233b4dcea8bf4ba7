// SPDX-License-Identifier: MIT
// Finds a stage of the pipeline that has input and no output (bytes → frames → samples → rates).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.hpp"
#include "drivers/frame_rate_check.hpp"
#include "drivers/wire/description/frame_description.hpp"

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

  /// Returns the problem ("100 frames and no number for axis z, for example \"1,25\"") while a stage has had at least
  /// 10 inputs and no output for kStarvedS; empty: none. Call at least once a second while data arrive; now_ns: arrival
  /// time.
  std::string push(const Pipeline& pipeline, std::int64_t now_ns);
  /// A new session: the time before it does not count.
  void begin() { stages_.clear(); }

 private:
  struct Stage {
    std::int64_t since_ns = 0;  ///< when its output last grew
    StageCounts before;         ///< the counts at that time
  };

  std::vector<Stage> stages_;  ///< frames, samples, and the rates of each axis
};

/// How described and arrival times disagree, in one line; empty if they do not.
std::string clocks_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check);
/// A gyro with time tags that sends another number of frames than described, in one line; else empty. Its times are
/// right.
std::string tagged_rate_text(const wire::FrameDescription& frames, const drivers::FrameRateCheck& check);

}  // namespace prism::pipeline
