// SPDX-License-Identifier: MIT
// Parameters of the method "send".
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "base/result.hpp"
#include "daemon/pipeline/setup.hpp"

namespace prism::socket {

struct SendParams {
  std::size_t line = 0;             ///< 0: the gyro's; sensor lines follow
  std::vector<std::uint8_t> bytes;  ///< 1 to 1024
};

/// Reads {"text": …} or {"hex": "55 AA"}, and "line", the name of a sensor line. The error's text is for the client.
Result<SendParams> send_params(const nlohmann::json& params, const pipeline::Setup& setup);

}  // namespace prism::socket
