// SPDX-License-Identifier: MIT
// How prismweb's coroutines wait: an error is a value, not an exception.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace prism::prismweb {

inline constexpr auto kUse = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace prism::prismweb
