// SPDX-License-Identifier: MIT
// Builds the JSON results of methods from the current state. They contain no NaN or infinity.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pipeline/device.hpp"
#include "daemon/socket/event_log.hpp"
#include "daemon/socket/publisher.hpp"

namespace prism::socket {

/// All members must outlive this.
struct Sources {
  const pipeline::Device& device;
  const EventLog& events;
  Publisher& publisher;     ///< subscriptions change it
  std::int64_t started_ns;  ///< host time
};

/// The result of a method that shows the state of the device; of a method of an axis: of `axes`, by name. `method`: not
/// one that Rpc handles itself.
nlohmann::ordered_json answer(const Sources& sources, std::string_view method, const std::vector<std::size_t>& axes);

/// One human-readable line, also for systemd's STATUS=.
std::string summary(const Sources& sources);

}  // namespace prism::socket
