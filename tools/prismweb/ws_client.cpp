// SPDX-License-Identifier: MIT
#include "tools/prismweb/ws_client.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "config/socket_protocol.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using client::error_member;
using client::kUse;
using nlohmann::json;

constexpr int kMaxPendingRequests = 32, kMaxLevels = 32;
constexpr std::size_t kMaxClients = 64, kMaxIdBytes = 64, kMinTrimBytes = 1 << 20;
constexpr std::uint16_t kUnknownData = 1003, kPolicyError = 1008, kTryAgainLater = 1013;

Text text_of(std::string text) { return std::make_shared<const std::string>(std::move(text)); }

}  // namespace

Connection::Connection(std::shared_ptr<Connections> all, int descriptor)
    : fd(descriptor), all_(std::move(all)), at_(all_->all_.insert(all_->all_.end(), this)) {}

Connection::~Connection() {
  remove_unsent(unsent_bytes_);
  all_->all_.erase(at_);
}

void Connection::add_unsent(std::size_t bytes) {
  if (is_ending_) return;
  unsent_bytes_ += bytes;
  all_->unsent_bytes_ += bytes;
  all_->peak_unsent_bytes_ = std::max(all_->peak_unsent_bytes_, all_->unsent_bytes_);
  const auto less = [](const Connection* a, const Connection* b) { return a->unsent_bytes_ < b->unsent_bytes_; };
  while (all_->unsent_bytes_ > Connections::kMaxUnsentBytes)
    (*std::max_element(all_->all_.begin(), all_->all_.end(), less))->close();
}

void Connection::remove_unsent(std::size_t bytes) {
  if (is_ending_) return;
  unsent_bytes_ -= bytes;
  all_->unsent_bytes_ -= bytes;
}

// The session then fails to read and to write, and frees its data.
void Connection::close() {
  all_->unsent_bytes_ -= std::exchange(unsent_bytes_, 0);
  is_ending_ = true;
  if (fd >= 0) ::shutdown(fd, SHUT_RDWR);
}

bool Connections::make_room() {
  const auto is_ending = [](const Connection* one) { return one->is_ending_; };
  const auto ending = static_cast<std::size_t>(std::count_if(all_.begin(), all_.end(), is_ending));
  if (all_.size() - ending < kMaxConnections) return ending < kMaxConnections;
  const auto is_unknown = [](const Connection* one) { return !one->is_known && !one->is_ending_; };
  const auto oldest = std::find_if(all_.begin(), all_.end(), is_unknown);
  if (oldest != all_.end()) (*oldest)->close();
  return oldest != all_.end();
}

void Connections::trim() {
  if (peak_unsent_bytes_ < unsent_bytes_ + kMinTrimBytes) return;
  peak_unsent_bytes_ = unsent_bytes_;
  ::malloc_trim(0);
}

void SendQueue::count(const Waiting& one, bool is_added) {
  const std::size_t bytes = one.text->size() + kTextBytes;
  if (is_added) connection_->add_unsent(bytes);
  if (!is_added) connection_->remove_unsent(bytes);
  bytes_[one.kind] += is_added ? bytes : -bytes;
}

void SendQueue::put(Text text, Kind kind) {
  const auto not_begun = waiting_.begin() + (waiting_.empty() ? 0 : 1);
  const auto older = std::find_if(not_begun, waiting_.end(), [](const Waiting& one) { return one.kind == kList; });
  if (kind == kList && older != waiting_.end()) {
    count(*older, false);
    waiting_.erase(older);
  }
  waiting_.push_back({std::move(text), kind});
  count(waiting_.back(), true);
}

void SendQueue::put_batch(const std::string& instance, Text text, std::uint64_t rows) {
  is_losing_ = is_losing_ || (bytes_[kBatch] > 0 && bytes_[kBatch] + text->size() > kMaxBatchBytes);
  if (!is_losing_) return put(std::move(text), kBatch);
  lost_[instance].rows += rows;
  lost_[instance].rows_total += rows;
}

void SendQueue::pop() {
  if (waiting_.empty()) return;
  count(waiting_.front(), false);
  waiting_.pop_front();
  if (bytes_[kBatch] > 0 || !std::exchange(is_losing_, false)) return;
  for (auto& [instance, lost] : lost_) {
    if (lost.rows == 0) continue;
    const json params = {{"instance", instance}, {"rows", lost.rows}, {"rows_total", lost.rows_total}};
    put(text_of(json_text(json({{"jsonrpc", "2.0"}, {"method", "lost"}, {"params", params}}))), kBatch);
    lost.rows = 0;
  }
}

void SendQueue::clear() {
  connection_->remove_unsent(bytes());
  waiting_.clear();
  bytes_ = {};
}

WsClient::WsClient(std::shared_ptr<Router> router, std::shared_ptr<Connection> connection, bool is_authenticated)
    : router_(std::move(router)),
      connection_(std::move(connection)),
      is_authenticated_(is_authenticated),
      queue_(connection_),
      long_turn_(router_->io(), 1),
      changed_(router_->io(), asio::steady_timer::time_point::max()) {}

std::optional<CloseReason> WsClient::message(std::string_view text, bool is_text) {
  if (!is_text) return CloseReason{kUnknownData, "found binary data, expected text"};
  if (!is_admitted_) return admit(text);
  request(parse_json_line(text, kMaxLevels).value_or(json()));
  return std::nullopt;
}

std::optional<CloseReason> WsClient::admit(std::string_view text) {
  const json first = parse_json_line(text, kMaxLevels).value_or(json());
  if (!first.is_object()) return CloseReason{kPolicyError, R"(expected {"token": "…"} first)"};
  const std::string token = text_member(first, "token");
  const bool is_right = token.empty() ? is_authenticated_ : router_->access().is_program_token(token);
  if (!is_right) return CloseReason{kPolicyError, token.empty() ? "found no token" : "wrong token"};
  if (router_->gyros().subscribers() >= kMaxClients)
    return CloseReason{kTryAgainLater, "64 clients are connected; retry later"};
  is_admitted_ = connection_->is_known = true;
  announce(text_of(router_->greeting()));
  router_->gyros().add(this);
  return std::nullopt;
}

void WsClient::request(const json& request) {
  const json& id = member(request, "id");
  const std::string id_text = json_text(id);
  const std::size_t id_bytes = id.is_string() ? id.get_ref<const std::string&>().size() : id_text.size();
  if (!(id.is_number() || id.is_string()) || id_bytes > kMaxIdBytes)
    return answer("null", "",
                  error_member(config::kInvalidRequest,
                               request.is_object() ? "expected \"id\", a number or a string of at most 64 bytes"
                                                   : "expected a request, a JSON object"));
  const std::string instance = text_member(request, "instance"), method = text_member(request, "method");
  const json& params = member(request, "params");
  if (method == "subscribe" || method == "unsubscribe")
    return subscribe(id_text, instance, params, method == "subscribe");
  const config::SocketMethod* const known = config::find_method(method);
  if (known != nullptr && known->of_axes && member(request, "protocol") != config::kProtocol)
    return answer(id_text, instance, error_member(config::kInvalidRequest, std::string(config::kOlderClient)));
  if (pending_requests_ >= kMaxPendingRequests)
    return answer(id_text, instance, error_member(config::kBusy, "32 requests are pending; wait for a response"));
  ++pending_requests_;
  asio::co_spawn(router_->io(), respond(id_text, instance, method, params), asio::detached);
}

// A long response is sent before the next one is requested, so that one client cannot queue many.
asio::awaitable<void> WsClient::respond(std::string id, std::string instance, std::string method, json params) {
  const auto self = shared_from_this();
  const bool is_long = is_long_method(method);
  std::shared_ptr<void> turn;
  if (is_long) turn = co_await long_turn_.take();
  std::string member = error_member(config::kGone, "");
  if (!is_ended_) member = co_await router_->call(false, instance, std::move(method), std::move(params));
  --pending_requests_;
  if (is_long && member.size() > SendQueue::kMaxResponseBytes)
    member = error_member(config::kFailed, fmt::format("the response has {} bytes, expected at most {}; request one "
                                                       "axis, or less",
                                                       member.size(), SendQueue::kMaxResponseBytes));
  answer(id, instance, member, is_long);
  while (is_long && queue_.is_sending_long()) co_await progress();
}

void WsClient::subscribe(const std::string& id, const std::string& instance, const json& params, bool on) {
  const auto refuse = [&](const std::string& why) { answer(id, instance, error_member(config::kInvalidParams, why)); };
  GyroProxy* const gyro = router_->gyros().find(instance);
  if (gyro == nullptr) return refuse("no such instance");
  const auto subscription = subscription_of(params, on, gyro->subscription_of(this));
  if (!subscription) return refuse(subscription.error().text());
  const auto& axes = gyro->axes();
  for (const std::string& axis : subscription->axes) {  // the axes are unknown before the first connection
    if (axes.empty() || std::find(axes.begin(), axes.end(), axis) != axes.end()) continue;
    return refuse(fmt::format("found the axis \"{}\", expected one of {}", plain_text(axis.substr(0, 40)),
                              fmt::join(axes, ", ")));
  }
  gyro->subscribe(this, *subscription);
  const json result = {{"sample_every", subscription->sample_every},
                       {"window", subscription->windows},
                       {"event", subscription->events},
                       {"axes", subscription->axes.empty() ? axes : subscription->axes}};
  answer(id, instance, "\"result\":" + json_text(result));
}

void WsClient::answer(const std::string& id, const std::string& instance, const std::string& member, bool is_long) {
  if (is_ended_) return;
  const std::string of = instance.empty() ? "" : R"(,"instance":)" + json_text(json(instance));
  queue_.put(text_of(R"({"jsonrpc":"2.0","id":)" + id + "," + member + of + "}"),
             is_long ? SendQueue::kLong : SendQueue::kResponse);
  changed_.cancel();
}

void WsClient::deliver(const std::string& instance, const Text& batch, std::uint64_t rows) {
  queue_.put_batch(instance, batch, rows);
  changed_.cancel();
}

void WsClient::announce(const Text& notification) {
  queue_.put(notification, SendQueue::kList);
  changed_.cancel();
}

asio::awaitable<void> WsClient::progress() { co_await changed_.async_wait(kUse); }

asio::awaitable<Text> WsClient::next() {
  while (queue_.empty() && !is_ended_) co_await progress();
  if (is_ended_) co_return nullptr;
  co_return queue_.front();
}

void WsClient::sent() {
  queue_.pop();
  changed_.cancel();
}

void WsClient::end() {
  is_ended_ = true;
  router_->gyros().remove(this);
  queue_.clear();
  changed_.cancel();
}

}  // namespace prism::prismweb
