// SPDX-License-Identifier: MIT
// The JSON API for programs: /api/….
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

/// True for targets that require the token.
bool is_api(std::string_view target);

struct ApiCall {
  std::string instance, method;
  nlohmann::json params = nlohmann::json::object();
};
/// Parses "/api/gyro1/history?seconds=60". Errors: another form, an invalid escape ("%zz").
Result<ApiCall> parse_api(std::string_view target);

boost::asio::awaitable<Answer> api_answer(WebServer& server, std::string_view target);

}  // namespace prism::prismweb
