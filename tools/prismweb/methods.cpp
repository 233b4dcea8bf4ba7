// SPDX-License-Identifier: MIT
#include "tools/prismweb/methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "base/plain_text.hpp"
#include "tools/prismweb/archive.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

struct Method {
  std::string_view name;
  std::vector<std::string_view> params;
};

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    words.push_back(text.substr(0, text.find(' ')));
    text.remove_prefix(std::min(text.size(), words.back().size() + 1));
  }
  return words;
}

// Parameters of `rows` that would store a cursor, or block the connection that all clients share.
bool is_offered(std::string_view param) { return param != "name" && param != "wait_s"; }

// prismweb's own, and prismd's that only read. Excludes config, which contains paths of the host.
const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = [] {
    std::vector<Method> all = {{"instances", {}}, {"range", {"axis", "from_s", "to_s", "seconds", "points"}}};
    for (const config::SocketMethod& method : config::kSocketMethods) {
      if (method.acts || method.is_local) continue;
      all.push_back({method.name, words_of(method.params)});
      std::erase_if(all.back().params, [](std::string_view param) { return !is_offered(param); });
    }
    return all;
  }();
  return kMethods;
}
constexpr std::array<std::string_view, 3> kSubscriptionParams = {"streams", "every", "axes"};

// More than any device has. Each row is compared with a client's list, so its length is limited.
constexpr std::size_t kMaxAxes = 64;

std::string unknown_method(const std::string& method) {
  std::vector<std::string_view> names;
  for (const Method& one : methods()) names.push_back(one.name);
  return fmt::format("no method \"{}\"; expected one of {}; subscribe and unsubscribe require the WebSocket",
                     plain_text(method.substr(0, 40)), fmt::join(names, ", "));
}

std::string unknown_instance(const std::string& instance) {
  return error_member(kInvalidParams, "no instance \"" + plain_text(instance, 80) + "\"");
}

}  // namespace

std::string unknown_param(std::string_view method, const json& params, std::span<const std::string_view> allowed) {
  if (!params.is_object()) return "";
  for (const auto& [name, value] : params.items()) {
    if (std::find(allowed.begin(), allowed.end(), name) != allowed.end()) continue;
    return fmt::format("{}: found the parameter \"{}\", expected {}", method, plain_text(name, 40),
                       allowed.empty() ? "none" : fmt::format("only {}", fmt::join(allowed, ", ")));
  }
  return "";
}

void call_method(WebServer& server, const std::string& instance, const std::string& method, const json& params,
                 const InstanceProxy::Answer& answer) {
  const auto known =
      std::find_if(methods().begin(), methods().end(), [&](const Method& m) { return m.name == method; });
  if (known == methods().end()) return answer(error_member(kUnknownMethod, unknown_method(method)));
  const std::string unknown = unknown_param(method, params, known->params);
  if (!unknown.empty()) return answer(error_member(kInvalidParams, unknown));
  if (method == "instances") return answer("\"result\":" + json_text(server.instances().listing()));
  if (method == "range") {
    Archive* const archive = server.archive(instance);
    return archive != nullptr ? archive->range(params, answer) : answer(unknown_instance(instance));
  }
  InstanceProxy* const proxy = server.instances().find(instance);
  if (proxy == nullptr) return answer(unknown_instance(instance));
  if (!params.is_null() && !params.is_object())
    return answer(error_member(kInvalidParams, "params: expected an object"));
  proxy->call(method, params, answer);
}

std::optional<Subscription> subscription_from_params(const json& params, bool on, const Subscription& before) {
  Subscription subscription = before;
  const json empty = json::object();
  const json& given = params.is_null() ? empty : params;
  if (!given.is_object() || !unknown_param("", given, kSubscriptionParams).empty()) return std::nullopt;
  std::uint32_t every = 1;
  if (given.contains("every")) {
    const json& value = given["every"];
    if (!value.is_number_integer() || value < 1 || value > 1'000'000) return std::nullopt;
    every = value;
  }
  subscription.axes.clear();
  if (given.contains("axes")) {
    if (!given["axes"].is_array() || given["axes"].empty() || given["axes"].size() > kMaxAxes) return std::nullopt;
    for (const json& axis : given["axes"]) {
      if (!axis.is_string()) return std::nullopt;
      subscription.axes.push_back(axis);
    }
    std::sort(subscription.axes.begin(), subscription.axes.end());
  }
  if (!given.contains("streams")) {
    subscription.sample_every = on ? every : 0;
    subscription.windows = subscription.events = on;
    return subscription;
  }
  if (!given["streams"].is_array() || given["streams"].empty()) return std::nullopt;
  for (const json& stream : given["streams"]) {
    if (stream == "sample") {
      subscription.sample_every = on ? every : 0;
    } else if (stream == "window") {
      subscription.windows = on;
    } else if (stream == "event") {
      subscription.events = on;
    } else {
      return std::nullopt;
    }
  }
  return subscription;
}

json subscription_json(const Subscription& subscription, const std::vector<std::string>& axes) {
  return {{"sample_every", subscription.sample_every},
          {"window", subscription.windows},
          {"event", subscription.events},
          {"axes", subscription.axes.empty() ? axes : subscription.axes}};
}

}  // namespace prism::prismweb
