// SPDX-License-Identifier: MIT
#include "tools/prismweb/ws_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/plain_text.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/methods.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr int kMaxPendingRequests = 32;
constexpr std::size_t kMaxIdBytes = 64;
constexpr std::uint16_t kUnknownData = 1003, kPolicyError = 1008, kTryAgainLater = 1013;

}  // namespace

std::optional<CloseReason> WsClient::message(std::string_view text, bool is_text) {
  if (!is_text) return CloseReason{kUnknownData, "found binary data, expected text"};
  if (!is_admitted_) return admit(text);
  request(text);
  return std::nullopt;
}

std::optional<CloseReason> WsClient::admit(std::string_view text) {
  const json first = parse_message(text);
  if (!first.is_object()) return CloseReason{kPolicyError, R"(expected {"token": "…"} first)"};
  const std::string token = text_member(first, "token");
  const bool is_right = token.empty() ? is_authenticated_ : server().is_program_token(token);
  if (!is_right) return CloseReason{kPolicyError, token.empty() ? "found no token" : "wrong token"};
  if (!server().has_room_for_client()) return CloseReason{kTryAgainLater, WebServer::kNoRoom};
  is_admitted_ = true;
  channel().answer(std::make_shared<const std::string>(server().greeting()));
  add_to_server();
  return std::nullopt;
}

std::string WsClient::lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const {
  const json params = {{"instance", instance}, {"rows", rows}, {"rows_total", rows_total}};
  return json_text({{"jsonrpc", "2.0"}, {"method", "lost"}, {"params", params}});
}

void WsClient::request(std::string_view text) {
  const json request = parse_message(text);
  if (!request.is_object())
    return answer("null", "", error_member(kInvalidRequest, "expected a request, a JSON object"));
  const json id = request.value("id", json());
  const std::string id_text = json_text(id);
  const std::size_t id_bytes = id.is_string() ? id.get_ref<const std::string&>().size() : id_text.size();
  if (!(id.is_number() || id.is_string()) || id_bytes > kMaxIdBytes)
    return answer("null", "",
                  error_member(kInvalidRequest, "expected \"id\", a number or a string of at most 64 bytes"));
  const std::string instance = text_member(request, "instance"), method = text_member(request, "method");
  const json params = request.value("params", json());
  if (method == "subscribe" || method == "unsubscribe") {
    InstanceProxy* const proxy = server().instances().find(instance);
    if (proxy == nullptr) return answer(id_text, instance, error_member(kInvalidParams, "no such instance"));
    return subscribe(*proxy, id_text, params, method == "subscribe");
  }
  const config::SocketMethod* const known = config::find_method(method);
  if (known != nullptr && known->of_axes && request.value("protocol", json()) != config::kProtocol)
    return answer(id_text, instance, error_member(kInvalidRequest, std::string(config::kOlderClient)));
  if (pending_requests_ >= kMaxPendingRequests)
    return answer(id_text, instance, error_member(kBusy, "32 requests are pending; wait for a response"));
  ++pending_requests_;
  const InstanceProxy::Answer reply = [weak = weak_from_this(), id_text, instance](std::string_view member) {
    const auto client = std::static_pointer_cast<WsClient>(weak.lock());
    if (!client) return;
    --client->pending_requests_;
    client->answer(id_text, instance, member);
  };
  call_method(server(), instance, method, params, reply);
}

void WsClient::subscribe(InstanceProxy& proxy, const std::string& id, const json& params, bool on) {
  const auto subscription = subscription_from_params(params, on, proxy.subscriptions().subscription_of(this));
  if (!subscription) {
    return answer(
        id, proxy.name(),
        error_member(kInvalidParams, "found " + json_text(params).substr(0, 80) +
                                         R"(, expected {"streams": ["sample", "window", "event"], "every": 1 to )"
                                         R"(1000000, "axes": [NAME, …]})"));
  }
  const auto is_unknown = [&](const std::string& axis) {  // the axes are unknown before the first connection
    return !proxy.axes().empty() && std::find(proxy.axes().begin(), proxy.axes().end(), axis) == proxy.axes().end();
  };
  const auto unknown = std::find_if(subscription->axes.begin(), subscription->axes.end(), is_unknown);
  if (unknown != subscription->axes.end()) {
    const std::string error_text = fmt::format("found the axis \"{}\", expected one of {}",
                                               plain_text(unknown->substr(0, 40)), fmt::join(proxy.axes(), ", "));
    return answer(id, proxy.name(), error_member(kInvalidParams, error_text));
  }
  proxy.subscribe(this, *subscription);
  answer(id, proxy.name(), "\"result\":" + json_text(subscription_json(*subscription, proxy.axes())));
}

void WsClient::answer(const std::string& id, const std::string& instance, std::string_view member) {
  std::string text = R"({"jsonrpc":"2.0","id":)" + id + ",";
  text += member;
  if (!instance.empty()) text += R"(,"instance":)" + json_text(instance);
  text += '}';
  channel().answer(std::make_shared<const std::string>(std::move(text)));
}

}  // namespace prism::prismweb
