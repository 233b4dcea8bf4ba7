// SPDX-License-Identifier: MIT
// The line of an instrument beside the gyro: what its sensors said, by when it arrived.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "daemon/pipeline/setup.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

/// A value is in force from the arrival of the bytes that complete it until the next one, at most stale_after_s long.
/// What serves at a time depends on the bytes and their arrival times only, not on when it is asked.
class SensorFeed {
 public:
  explicit SensorFeed(const Setup::SensorLine& line);

  /// The line was opened (again) at now_ns. What was said before holds on, unless the host's clock was set back.
  void begin_session(std::int64_t now_ns);
  /// `needed_since_ns`: no earlier time will be asked for; `latest_ns`: the last time that may be asked for, but for
  /// those that are still to come. What lies between is kept, at most one value beyond.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::int64_t needed_since_ns,
            std::int64_t latest_ns);

  /// Writes what was in force at `at_ns`, for a sensor each; kUnknown where nothing was.
  void values_at(std::int64_t at_ns, std::span<double> values) const;
  /// Arrival of the last value of any sensor.
  std::optional<std::int64_t> last_ns() const;

  std::size_t sensors() const { return decoder_.description().sensors.size(); }
  const wire::FrameDecoder& decoder() const { return decoder_; }

 private:
  struct Said {
    std::int64_t arrival_ns;
    std::vector<double> values;
  };
  void forget(std::int64_t needed_since_ns, std::int64_t latest_ns);

  wire::FrameDecoder decoder_;
  std::int64_t stale_ns_;
  std::deque<Said> said_;  ///< oldest first
  std::vector<wire::Reading> readings_;
};

}  // namespace prism::pipeline
