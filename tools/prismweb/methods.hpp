// SPDX-License-Identifier: MIT
// Methods for clients of the WebSocket and of the JSON API.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class WebServer;

/// Calls `method` of `instance`, and `answer` with the member `"result":…` or `"error":{…}`, now or later. Does not
/// handle subscribe and unsubscribe, which need a connection.
void call_method(WebServer& server, const std::string& instance, const std::string& method,
                 const nlohmann::json& params, const InstanceProxy::Answer& answer);

/// Returns an error text with the list of `allowed` names if `params` has another member; otherwise an empty string.
std::string unknown_param(std::string_view method, const nlohmann::json& params,
                          std::span<const std::string_view> allowed);

/// Applies the params of subscribe (`on`) or unsubscribe to the subscription `before`, as prismd does. Returns nullopt
/// if they are invalid or have other members than `streams`, `every`, `axes`.
std::optional<Subscription> subscription_from_params(const nlohmann::json& params, bool on, const Subscription& before);

/// The result of subscribe and unsubscribe, as prismd returns it.
nlohmann::json subscription_json(const Subscription& subscription, const std::vector<std::string>& axes);

}  // namespace prism::prismweb
