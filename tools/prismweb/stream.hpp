// SPDX-License-Identifier: MIT
// Stream of a TCP or Unix socket.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/basic_stream.hpp>

namespace prism::prismweb {

using Stream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;

}  // namespace prism::prismweb
