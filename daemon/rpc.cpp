// SPDX-License-Identifier: MIT
#include "daemon/rpc.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "compensation/json_section.hpp"
#include "config/version.hpp"

namespace prism::daemon {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kMethods =
    "version, status, bias, stability, line, model, config, history, events, subscribe, unsubscribe, reload";

// Whatever bytes a client sent, what goes back is UTF-8.
std::string line_of(const ordered_json& message) {
  return message.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

// A whole number within 1 to max of the params object, or `otherwise`; nothing where it is something else.
std::optional<std::size_t> count_param(const json& params, const char* key, std::size_t otherwise, std::size_t max) {
  if (params.is_null() || (params.is_object() && !params.contains(key))) return otherwise;
  if (!params.is_object() || !params[key].is_number_integer()) return std::nullopt;
  const auto value = params[key].get<std::int64_t>();
  if (value < 1 || value > static_cast<std::int64_t>(max)) return std::nullopt;
  return static_cast<std::size_t>(value);
}

}  // namespace

std::string rpc_error(const json& id, int code, const std::string& message) {
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", message}}}});
}

std::string rpc_result(const json& id, const ordered_json& result) {
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"result", result}});
}

void Rpc::request(const std::shared_ptr<Client>& client, std::string_view line) {
  json parsed;
  try {
    parsed = json::parse(line);
  } catch (const json::exception&) {
    return client->answer(
        rpc_error(nullptr, kParseError, "the line is not valid JSON; expected one JSON-RPC 2.0 request a line"));
  }
  if (!parsed.is_array()) return one(client, parsed);
  if (parsed.empty())
    return client->answer(rpc_error(nullptr, kInvalidRequest, "found an empty batch, expected requests"));
  for (const json& request : parsed) one(client, request);
}

void Rpc::one(const std::shared_ptr<Client>& client, const json& request) {
  const auto invalid = [&](const json& id, const std::string& message) {
    client->answer(rpc_error(id, kInvalidRequest, message));
  };
  if (!request.is_object()) return invalid(nullptr, "found " + shown(request) + ", expected a request object");
  const bool has_id = request.contains("id");
  const json id = has_id ? request["id"] : json();
  if (has_id && !id.is_string() && !id.is_number() && !id.is_null()) {
    return invalid(nullptr, "found id " + shown(id) + ", expected a text, a number or null");
  }
  if (request.value("jsonrpc", json()) != "2.0") return invalid(id, "expected \"jsonrpc\": \"2.0\"");
  const json method = request.value("method", json());
  if (!method.is_string()) return invalid(id, "found method " + shown(method) + ", expected a text");
  dispatch(method.get<std::string>(), {client, id, has_id, request.value("params", json())});
}

void Rpc::dispatch(const std::string& method, const Call& call) {
  if (method == "version") return reply(call, {{"name", "prismd"}, {"version", kVersion}, {"protocol", 1}});
  if (method == "status") return reply(call, station_.status());
  if (method == "bias") return reply(call, station_.bias());
  if (method == "stability") return reply(call, station_.stability());
  if (method == "line") return reply(call, station_.line());
  if (method == "model") return reply(call, station_.model());
  if (method == "config") return reply(call, station_.config());
  if (method == "subscribe") return subscribe(call, true);
  if (method == "unsubscribe") return subscribe(call, false);
  if (method == "reload") return reload(call);
  if (method == "history" || method == "events") {
    const bool history = method == "history";
    const std::size_t most = history ? 3600 : EventLog::kKept;
    const auto count = count_param(call.params, history ? "seconds" : "count", history ? 100 : most, most);
    if (!count) {
      return fail(call, kInvalidParams,
                  fmt::format("found {}, expected {{\"{}\": 1 to {}}}", shown(call.params),
                              history ? "seconds" : "count", most));
    }
    return reply(call, history ? station_.history(*count) : station_.events(*count));
  }
  fail(call, kMethodNotFound, fmt::format("no method \"{:.40}\"; expected one of {}", method, kMethods));
}

void Rpc::subscribe(const Call& call, bool on) {
  Subscription wanted = call.client->subscription;
  const json streams = call.params.is_object() ? call.params.value("streams", json()) : json();
  const auto every = count_param(call.params, "every", 1, 1'000'000);
  bool known = streams.is_array() && !streams.empty() && every;
  if (streams.is_null() && every) {
    known = true;
    wanted = on ? Subscription{static_cast<std::uint32_t>(*every), true, true} : Subscription{};
  }
  for (const json& stream : streams.is_array() ? streams : json::array()) {
    if (stream == "sample") {
      wanted.sample_every = on && every ? static_cast<std::uint32_t>(*every) : 0;
    } else if (stream == "window") {
      wanted.windows = on;
    } else if (stream == "event") {
      wanted.events = on;
    } else {
      known = false;
    }
  }
  if (!known) {
    return fail(call, kInvalidParams,
                "found " + shown(call.params) +
                    R"(, expected {"streams": ["sample", "window", "event"], "every": 1 to 1000000})");
  }
  reply(call, {{"sample_every", wanted.sample_every}, {"window", wanted.windows}, {"event", wanted.events}});
  call.client->subscription = wanted;
  station_.publisher.update();
}

void Rpc::reload(const Call& call) {
  if (!call.client->privileged()) {
    return fail(call, kNotPermitted, "reload needs root or the user that prismd runs as");
  }
  reload_([this, call](Result<std::string> outcome) {
    outcome ? reply(call, {{"reloaded", *outcome}}) : fail(call, kRefused, outcome.error().text());
  });
}

void Rpc::reply(const Call& call, const ordered_json& result) {
  if (call.wants_answer) call.client->answer(rpc_result(call.id, result));
}

void Rpc::fail(const Call& call, int code, const std::string& message) {
  if (call.wants_answer) call.client->answer(rpc_error(call.id, code, message));
}

}  // namespace prism::daemon
