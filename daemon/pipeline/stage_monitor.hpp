// SPDX-License-Identifier: MIT
// Finds a stage of the pipeline that has input and no output (bytes → frames → samples → rates), and frames at another
// rate than described.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
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

/// Counts samples per full second, for gyros with time tags. Without them (FrameDescription::counts_frames()) the times
/// follow from rate_hz, and FrameRateCheck compares it with the arrivals.
class RateMonitor {
 public:
  explicit RateMonitor(double rate_hz) : rate_hz_(rate_hz) {}

  /// Adds the number of samples of a full second. After each 30 of them, returns a problem if their median differs from
  /// rate_hz by more than 10 % and at most 10 % of them differ from the median (unlike a line that loses frames now and
  /// then), and an empty text if the median does not differ.
  std::optional<std::string> push(std::uint32_t samples);
  /// Call at a new session: discards the seconds before it.
  void begin() { seconds_.clear(); }

 private:
  double rate_hz_;
  std::vector<std::uint32_t> seconds_;
};

}  // namespace prism::pipeline
