// SPDX-License-Identifier: MIT
// A line through UDP: a device that sends datagrams to prismd.
#pragma once

#include "drivers/transport/transport.hpp"

namespace prism::transport {

/// {"listen": "HOST:PORT", "from": "ADDRESS" or "ADDRESS:PORT"}.
const JsonTable<Network>& udp_keys();

/// Receives the datagrams that arrive at the address; ignores those of other hosts than "from". One read returns one
/// datagram. Bytes are sent to the port in "from", else to the sender of the last datagram. A line that does not listen
/// (prismsim) sends to its address, an IP address, from any free port.
Result<std::unique_ptr<Transport>> open_udp_line(boost::asio::io_context& io, const Settings& settings);

}  // namespace prism::transport
