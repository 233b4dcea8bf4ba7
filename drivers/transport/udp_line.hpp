// SPDX-License-Identifier: MIT
// A line through UDP: a device that sends datagrams to prismd.
#pragma once

#include "base/json_section.hpp"
#include "drivers/transport/transport.hpp"

namespace prism::transport {

/// Reads {"listen": "HOST:PORT", "from": "ADDRESS" or "ADDRESS:PORT"}.
Network read_udp_line(const Section& section);

/// Receives the datagrams that arrive at the address; ignores those of other hosts than "from". One read returns one
/// datagram. Bytes are sent to the port in "from", else to the sender of the last datagram. A line that does not listen
/// (prismsim) sends to its address, an IP address, from any free port.
Result<std::unique_ptr<Transport>> open_udp_line(boost::asio::io_context& io, const Settings& settings);

}  // namespace prism::transport
