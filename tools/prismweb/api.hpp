// SPDX-License-Identifier: MIT
// The JSON API for programs: /api/….
#pragma once

#include <boost/asio/awaitable.hpp>
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
  std::string_view query;  ///< part of the target
};
/// Parses "/api/gyro1/history?seconds=60", except the query. Errors: another form, an invalid escape ("%zz").
Result<ApiCall> parse_api(std::string_view target);
/// Parses "seconds=60&axis=z" to params. Errors: a repeated name, an empty name, an invalid escape.
Result<nlohmann::json> parse_query(std::string_view query);

boost::asio::awaitable<Answer> api_answer(WebServer& server, std::string_view target);

}  // namespace prism::prismweb
