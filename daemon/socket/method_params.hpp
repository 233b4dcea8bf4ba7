// SPDX-License-Identifier: MIT
// Parameters of the methods "send" and "rows", and counts. Errors are for the client.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "base/result.hpp"
#include "daemon/pipeline/log_writers.hpp"
#include "daemon/pipeline/setup.hpp"

namespace prism::socket {

/// Returns the integer parameter, 1 to max, or `otherwise` if it is missing; nullopt if it is invalid.
std::optional<std::size_t> count_param(const nlohmann::json& params, const char* key, std::size_t otherwise,
                                       std::size_t max);

struct SendParams {
  std::size_t line = 0;             ///< 0: the gyro's; sensor lines follow
  std::vector<std::uint8_t> bytes;  ///< 1 to 1024
};

/// Reads {"text": …} or {"hex": "55 AA"}, and "line", the name of a sensor line.
Result<SendParams> send_params(const nlohmann::json& params, const pipeline::Setup& setup);

/// Parameters of "rows" without the axis.
struct RowParams {
  pipeline::RowQuery query;
  double wait_s = 0;
};
Result<RowParams> row_params(const nlohmann::json& params);

}  // namespace prism::socket
