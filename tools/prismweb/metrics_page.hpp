// SPDX-License-Identifier: MIT
// /metrics: metrics of all gyros for Prometheus.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "tools/prismweb/http_message.hpp"

namespace prism::prismweb {

class WebServer;

/// Requests status, line and stability from all instances. One that is not running has only prism_up 0.
boost::asio::awaitable<Answer> metrics_answer(WebServer& server);

}  // namespace prism::prismweb
