// SPDX-License-Identifier: MIT
// The methods that a client of prismweb may call, of the WebSocket or by plain JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/prismweb/hub.hpp"

namespace prism::prismweb {

class Site;

/// Calls `method` of `instance`. `answer` gets the member `"result":…` or `"error":{…}`, now or later. subscribe and
/// unsubscribe, which belong to a connection, are not among these.
void call_method(Site& site, const std::string& instance, const std::string& method, const nlohmann::json& params,
                 const Hub::Answer& answer);

/// Reads the params of subscribe (`on`) or unsubscribe as prismd does, over what is wished already; nothing where they
/// are wrong.
std::optional<Wish> wish_of_params(const nlohmann::json& params, bool on, const Wish& before);

/// What prismd answers to them.
nlohmann::json wish_json(const Wish& wish, const std::vector<std::string>& axes);

}  // namespace prism::prismweb
