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

constexpr int kMostUnderWay = 32;
constexpr std::size_t kMostIdBytes = 64;
constexpr std::uint16_t kUnknownData = 1003, kPolicyError = 1008, kTryAgainLater = 1013;

}  // namespace

std::optional<CloseReason> WsClient::message(std::string_view text, bool is_text) {
  if (!is_text) return CloseReason{kUnknownData, "found bytes, expected text"};
  if (!let_in_) return let_in(text);
  request(text);
  return std::nullopt;
}

std::optional<CloseReason> WsClient::let_in(std::string_view text) {
  const json first = parse_message(text);
  if (!first.is_object()) return CloseReason{kPolicyError, R"(expected {"token": "…"} first)"};
  const std::string token = text_member(first, "token");
  const bool is_right = token.empty() ? is_authenticated_ : server().is_program_token(token);
  if (!is_right) return CloseReason{kPolicyError, token.empty() ? "it has no token" : "its token is wrong"};
  if (!server().has_room_for_client()) return CloseReason{kTryAgainLater, WebServer::kNoRoom};
  let_in_ = true;
  channel().answer(std::make_shared<const std::string>(server().greeting()));
  enter();
  return std::nullopt;
}

std::string WsClient::lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const {
  const json params = {{"instance", instance}, {"rows", rows}, {"rows_total", rows_total}};
  return json_text({{"jsonrpc", "2.0"}, {"method", "lost"}, {"params", params}});
}

void WsClient::request(std::string_view text) {
  const json request = parse_message(text);
  if (!request.is_object()) return answer("null", "", error_member(-32600, "found no object, expected a request"));
  const json id = request.value("id", json());
  const std::string id_text = json_text(id);
  const std::size_t id_bytes = id.is_string() ? id.get_ref<const std::string&>().size() : id_text.size();
  if (!(id.is_number() || id.is_string()) || id_bytes > kMostIdBytes)
    return answer("null", "", error_member(-32600, "expected an id, a number or a text of at most 64 bytes"));
  const std::string instance = text_member(request, "instance"), method = text_member(request, "method");
  const json params = request.value("params", json());
  if (method == "subscribe" || method == "unsubscribe") {
    InstanceProxy* const proxy = server().instances().find(instance);
    if (proxy == nullptr) return answer(id_text, instance, error_member(kWrongParams, "no such instance"));
    return subscribe(*proxy, id_text, params, method == "subscribe");
  }
  if (current_id_ >= kMostUnderWay)
    return answer(id_text, instance, error_member(kTooMuch, "32 requests are under way, expected fewer"));
  ++current_id_;
  const InstanceProxy::Answer reply = [weak = weak_from_this(), id_text, instance](std::string_view member) {
    const auto client = std::static_pointer_cast<WsClient>(weak.lock());
    if (!client) return;
    --client->current_id_;
    client->answer(id_text, instance, member);
  };
  call_method(server(), instance, method, params, reply);
}

void WsClient::subscribe(InstanceProxy& proxy, const std::string& id, const json& params, bool on) {
  const auto subscription = wish_of_params(params, on, proxy.subscriptions().subscription_of(this));
  if (!subscription) {
    return answer(
        id, proxy.name(),
        error_member(kWrongParams, "found " + json_text(params).substr(0, 80) +
                                       R"(, expected {"streams": ["sample", "window", "event"], "every": 1 to )"
                                       R"(1000000, "axes": [NAME, …]})"));
  }
  const auto is_strange = [&](const std::string& axis) {  // where it never ran its axes are not known
    return !proxy.axes().empty() && std::find(proxy.axes().begin(), proxy.axes().end(), axis) == proxy.axes().end();
  };
  const auto strange = std::find_if(subscription->axes.begin(), subscription->axes.end(), is_strange);
  if (strange != subscription->axes.end()) {
    const std::string words = fmt::format("found the axis \"{}\", expected one of {}",
                                          plain_text(strange->substr(0, 40)), fmt::join(proxy.axes(), ", "));
    return answer(id, proxy.name(), error_member(kWrongParams, words));
  }
  proxy.subscribe(this, *subscription);
  answer(id, proxy.name(), "\"result\":" + json_text(wish_json(*subscription, proxy.axes())));
}

void WsClient::answer(const std::string& id, const std::string& instance, std::string_view member) {
  std::string text = R"({"jsonrpc":"2.0","id":)" + id + ",";
  text += member;
  if (!instance.empty()) text += R"(,"instance":)" + json_text(instance);
  text += '}';
  channel().answer(std::make_shared<const std::string>(std::move(text)));
}

}  // namespace prism::prismweb
