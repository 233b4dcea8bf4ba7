// SPDX-License-Identifier: MIT
// Completion token of prismweb's coroutines: errors are values, not exceptions.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace prism::prismweb {

inline constexpr auto kUse = boost::asio::as_tuple(boost::asio::use_awaitable);

}  // namespace prism::prismweb
