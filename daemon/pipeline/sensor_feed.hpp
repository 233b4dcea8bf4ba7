// SPDX-License-Identifier: MIT
// Sensor values of an instrument on a line of its own, by arrival time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "daemon/pipeline/setup.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

/// A value is valid from the arrival of its last byte until the next value, at most stale_after_s. The value at a time
/// depends only on the bytes and their arrival times, not on the time of the query.
class SensorFeed {
 public:
  explicit SensorFeed(const Setup::SensorLine& line);

  /// The line was opened (again) at now_ns. Earlier values stay valid unless the host clock was set back.
  void begin_session(std::int64_t now_ns);
  /// `needed_since_ns`: earliest time of later queries; `latest_ns`: latest time of queries for data so far. Values in
  /// between are stored, and at most one after.
  void feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns, std::int64_t needed_since_ns,
            std::int64_t latest_ns);

  /// Writes the value of each sensor that was valid at `at_ns`; kUnknown if no value was valid.
  void values_at(std::int64_t at_ns, std::span<double> values) const;
  /// Arrival of the last value of any sensor.
  std::optional<std::int64_t> last_ns() const;

  std::size_t sensors() const { return decoder_.description().sensors.size(); }
  const wire::FrameDecoder& decoder() const { return decoder_; }

 private:
  struct Values {
    std::int64_t arrival_ns;
    std::vector<double> values;
  };
  void forget(std::int64_t needed_since_ns, std::int64_t latest_ns);

  wire::FrameDecoder decoder_;
  std::int64_t stale_ns_;
  std::deque<Values> values_;  ///< oldest first
  std::vector<wire::DecodedMessage> readings_;
};

}  // namespace prism::pipeline
