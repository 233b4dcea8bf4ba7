// SPDX-License-Identifier: MIT
// Completion token of the daemon's coroutines: an error is a value, not an exception.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace prism::daemon {

inline constexpr auto kUse = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace prism::daemon
