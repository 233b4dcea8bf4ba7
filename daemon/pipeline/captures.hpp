// SPDX-License-Identifier: MIT
// The captures of a replay: opens the gyro's, and merges those of the sensor lines with its packets, by arrival time.
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
#include "drivers/wire/description/frame_description.hpp"

namespace prism::pipeline {

/// Opens a capture or raw bytes of the frames. Errors: those of CaptureReader::open().
Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames);

/// Prepares the setup for raw bytes: time comes from the counter and rate_hz (clock "device"), because there may be
/// other bytes between the frames. Without effect for captures. Errors: sensor lines, whose data could not be assigned
/// in time.
Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup);

/// Files of each line, by its name, in order.
using SensorFiles = std::map<std::string, std::vector<std::string>>;

/// Finds the files that prismd wrote: DIRECTORY/LINE/*.pcap in the directory of the gyro's capture, sorted by name.
SensorFiles sensor_files_beside(const Setup& setup, const std::string& gyro_capture);

/// Errors: a file of a sensor line that contains bytes, but no value of its sensors.
Result<void> check_sensor_files(const Setup& setup, const SensorFiles& files);

/// Orders by arrival; at equal times, the sensor line's packet is first. When the host clock was set back, every
/// capture has a session that begins before its last packet; the n-th of these points correspond in all captures.
class SensorCaptures {
 public:
  using Give = std::function<void(std::size_t line, const drivers::CapturePacket&)>;

  /// Errors: a line that the set-up does not have; a file that cannot be opened. Lines without files give a note.
  static Result<SensorCaptures> open(const Setup& setup, const SensorFiles& files);

  /// Passes all remaining packets up to the gyro's packet to `give`, those of the same time included.
  void until(const drivers::CapturePacket& gyro, const Give& give);

  /// Warnings about the files, one line each; after the end also on lines without data in the time of the gyro's.
  std::vector<std::string> notes() const;

 private:
  /// Counts how often the host clock was set back before a packet.
  struct Pass {
    std::int64_t last_ns = 0;
    int number = 0;
    void take(const drivers::CapturePacket& packet);
  };
  struct Stream {
    std::size_t line = 0;  ///< number of the sensor line
    std::string name;      ///< and its name
    double raw_bytes_per_s = 1;
    std::deque<std::string> files;
    std::optional<drivers::CaptureReader> reader;
    std::optional<drivers::CapturePacket> head;
    std::int64_t first_ns = 0, last_ns = 0;  ///< of packets that were read; 0: none
    Pass pass;
  };
  Result<void> advance(Stream& stream);

  std::vector<Stream> streams_;
  std::vector<std::string> notes_;
  Pass gyro_;
  std::int64_t gyro_first_ns_ = 0, gyro_last_ns_ = 0;  ///< 0: none
};

}  // namespace prism::pipeline
