// SPDX-License-Identifier: MIT
// Rejects HTTP requests that are invalid, ambiguous, too long or have a body.
#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>
#include <optional>

#include "tools/prismweb/http_message.hpp"

namespace prism::prismweb {

using RequestParser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

inline constexpr std::uint32_t kMaxHeaderBytes = 8 << 10;

/// Limits the header to kMaxHeaderBytes and the body to none.
void set_limits(RequestParser& parser);

/// Returns the response to a request whose header was read with `error`: 431 for a header that is too long, 400 for
/// invalid HTTP, a field that is repeated although access depends on it, Transfer-Encoding, or a body. The connection
/// must then be closed, because the start of the next request is unknown. Returns nullopt for a valid request, and if
/// the connection failed.
std::optional<Answer> rejection_of(const RequestParser& parser, const boost::system::error_code& error);

}  // namespace prism::prismweb
