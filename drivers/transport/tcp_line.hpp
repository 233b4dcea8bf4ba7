// SPDX-License-Identifier: MIT
// A line through TCP: a device server or a device with Ethernet, which prismd connects to or which connects to prismd.
#pragma once

#include "drivers/transport/transport.hpp"

namespace prism::transport {

/// {"address": "HOST:PORT"} or {"listen": "HOST:PORT", "from": "ADDRESS"}.
const JsonTable<Network>& tcp_keys();

/// Begins to connect, or to wait for a peer. Tries all addresses of a name in turn, at most 5 s each. A peer that
/// vanished is found by keepalive after 20 s. While a peer is connected, others are turned away.
Result<std::unique_ptr<Transport>> open_tcp_line(boost::asio::io_context& io, const Settings& settings);

}  // namespace prism::transport
