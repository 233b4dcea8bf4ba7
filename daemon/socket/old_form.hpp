// SPDX-License-Identifier: MIT
// Results in the form of protocol 1, for requests without "protocol": 2. To be removed with version 0.4.
#pragma once

#include <nlohmann/json.hpp>

#include "config/socket_protocol.hpp"

namespace prism::socket {

/// Converts a result of protocol 2: the members of the only axis move to the result itself; with several axes, the
/// result of a method that has nothing else is the object of axes.
nlohmann::ordered_json old_form(const config::SocketMethod& method, nlohmann::ordered_json result);

/// Code of a failed `rows` in protocol 1, which has only kUnknownCursor and kFailed.
config::SocketError old_code(config::SocketError code);

}  // namespace prism::socket
