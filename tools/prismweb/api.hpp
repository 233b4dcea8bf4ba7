// SPDX-License-Identifier: MIT
// Plain JSON for other programs: /api/….
#pragma once

#include <boost/asio/awaitable.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.hpp"
#include "tools/prismweb/http_message.hpp"

namespace prism::prismweb {

class WebServer;

/// Whether a target is one that needs the token.
bool is_api(std::string_view target);

/// "/api/gyro1/history?seconds=60" → instance, method, params. Refused where it is no such target, or an escape ("%zz")
/// is wrong.
struct ApiCall {
  std::string instance, method;
  nlohmann::json params = nlohmann::json::object();
};
Result<ApiCall> parse_api(std::string_view target);

boost::asio::awaitable<Answer> api_answer(WebServer& server, std::string_view target);

}  // namespace prism::prismweb
