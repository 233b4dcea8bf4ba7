// SPDX-License-Identifier: MIT
// The objects that responses to clients are built from.
#pragma once

#include <cstdint>

#include "daemon/pipeline/device.hpp"
#include "daemon/socket/event_log.hpp"
#include "daemon/socket/publisher.hpp"

namespace prism::socket {

/// All members must outlive this.
struct Sources {
  const pipeline::Device& device;
  const EventLog& events;
  const Publisher& publisher;
  std::int64_t started_ns;  ///< host time

  const pipeline::LineStatus& gyro_line() const { return device.lines[pipeline::kGyroLine]; }
};

}  // namespace prism::socket
