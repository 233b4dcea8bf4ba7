// SPDX-License-Identifier: MIT
// Result or error of a request to prismd.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "base/result.hpp"
#include "config/socket_protocol.hpp"

namespace prism::client {

struct RequestError {
  config::SocketError code;  ///< prismd's; kGone: no connection; kTimeout: no response
  Error error;

  std::string text() const { return error.text(); }
};

using Response = tl::expected<nlohmann::json, RequestError>;

/// Returns the result in `message`, a response to `method`. Errors: that of the response; kFailed if the result has the
/// form of protocol 1, because this prismd is older.
Response response_of(std::string_view method, nlohmann::json message);

/// The same for the member `"result":…` or `"error":{…}` of the message.
Response response_of_member(std::string_view method, std::string_view member);

/// Returns `"error":{"code":…,"message":…}`, a member of a response.
std::string error_member(int code, const std::string& message);

/// The part of a result that belongs to `axis`; of the only axis if it is empty; null if it does not exist.
const nlohmann::json& of_axis(const nlohmann::json& result, const std::string& axis);

/// Returns a result with the members of `axis` in the result itself, and those of its `log` in the log of all.
nlohmann::json with_axis(nlohmann::json result, const std::string& axis);

}  // namespace prism::client
