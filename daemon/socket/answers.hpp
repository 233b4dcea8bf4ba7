// SPDX-License-Identifier: MIT
// Builds the JSON results of methods from the current state. They contain no NaN or infinity.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "daemon/socket/sources.hpp"

namespace prism::socket {

using Answer = nlohmann::ordered_json (*)(const Sources& sources);
/// `axis`: index into Device::axes.
using AxisAnswer = nlohmann::ordered_json (*)(const Sources& sources, std::size_t axis);

/// Returns nullptr if the method is another one: of an axis, or one that Rpc handles itself.
Answer answer_of(std::string_view method);
/// The same for the methods of an axis.
AxisAnswer axis_answer_of(std::string_view method);

/// Bytes arrive, but for longer than a line may be silent (silence_s, at least three periods) no frame with gyro data
/// that can be used: the last values are old.
bool has_no_frames(const Sources& sources);

/// The quality of the correction in use, with that of the last values; kNoData without current data.
std::uint32_t current_quality(const Sources& sources, std::size_t axis);

/// One human-readable line, also for systemd's STATUS=.
std::string summary(const Sources& sources);

}  // namespace prism::socket
