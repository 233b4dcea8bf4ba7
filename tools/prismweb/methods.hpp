// SPDX-License-Identifier: MIT
// The methods that a client of prismweb may call, of the WebSocket or by plain JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class WebServer;

/// Calls `method` of `instance`. `answer` gets the member `"result":…` or `"error":{…}`, now or later. subscribe and
/// unsubscribe, which belong to a connection, are not among these.
void call_method(WebServer& server, const std::string& instance, const std::string& method,
                 const nlohmann::json& params, const InstanceProxy::Answer& answer);

/// Reads the params of subscribe (`on`) or unsubscribe as prismd does, over what is wished already; nothing where they
/// are wrong.
std::optional<Subscription> wish_of_params(const nlohmann::json& params, bool on, const Subscription& before);

/// What prismd answers to them.
nlohmann::json wish_json(const Subscription& subscription, const std::vector<std::string>& axes);

}  // namespace prism::prismweb
