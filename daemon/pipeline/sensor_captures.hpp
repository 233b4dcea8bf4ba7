// SPDX-License-Identifier: MIT
// Captures of the sensor lines, told between the packets of the gyro's as they came.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/pipeline/setup.hpp"
#include "drivers/capture_file.hpp"

namespace prism::pipeline {

/// Files of each line by its name, in order.
using SensorFiles = std::map<std::string, std::vector<std::string>>;

/// Where prismd leaves them: FOLDER/LINE/….pcap of the gyro capture's folder, in order of their names.
SensorFiles sensor_files_beside(const Setup& setup, const std::string& gyro_capture);

/// By arrival; a sensor line's packet first where it came with the gyro's. Where the host's clock was set back every
/// capture says so by a session that begins before the last packet: such places are each other's, one by one.
class SensorCaptures {
 public:
  using Give = std::function<void(std::size_t line, const drivers::CapturePacket&)>;

  /// Refused: a line that the set-up does not have, or a file that cannot be opened. Lines without files are noted.
  static Result<SensorCaptures> open(const Setup& setup, const SensorFiles& files);

  /// Gives what came before the gyro's packet or with it, and was not given.
  void until(const drivers::CapturePacket& gyro, const Give& give);

  /// What is to be known of the files: a line each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  /// Which of several passes of the host's clock over the same times a packet is of.
  struct Pass {
    std::int64_t last_ns = 0;
    int number = 0;
    void take(const drivers::CapturePacket& packet);
  };
  struct Stream {
    std::size_t line = 0;
    drivers::BareBytes bare;
    std::deque<std::string> files;
    std::optional<drivers::CaptureReader> reader;
    std::optional<drivers::CapturePacket> head;
    Pass pass;
  };
  Result<void> advance(Stream& stream);

  std::vector<Stream> streams_;
  std::vector<std::string> notes_;
  Pass gyro_;
};

}  // namespace prism::pipeline
