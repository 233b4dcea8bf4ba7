// SPDX-License-Identifier: MIT
// /metrics: what all gyros say of themselves, for Prometheus.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "tools/prismweb/http_message.hpp"

namespace prism::prismweb {

class WebServer;

/// Asks each instance that runs for status, line and stability. One that does not run has prism_up 0 alone.
boost::asio::awaitable<Answer> metrics_answer(WebServer& server);

}  // namespace prism::prismweb
