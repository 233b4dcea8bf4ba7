// SPDX-License-Identifier: MIT
#include "tools/prismweb/instance_proxy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/time_scale.hpp"
#include "config/socket_path.hpp"
#include "tools/client/response.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/service_run_id.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

constexpr std::chrono::milliseconds kRetry{500};
// A stopping service closes its clients before it exits; a connection in between would start it again. systemd kills it
// after 15 s (TimeoutStopSec).
constexpr std::chrono::seconds kStopTime{20};
// prismd responds without the id to a request of more than 2000 values, and closes the connection, which all clients
// share, if a line is longer than 65 536 bytes. Params of at most 2000 bytes exceed neither.
constexpr std::size_t kMaxParamsBytes = 2000;

bool is_long(std::string_view name) {
  const config::SocketMethod* const method = config::find_method(name);
  return method != nullptr && method->is_long;
}

}  // namespace

std::string error_member(int code, const std::string& message) {
  return R"("error":)" + json_text({{"code", code}, {"message", message}});
}

InstanceProxy::InstanceProxy(asio::io_context& io, std::string name, std::string socket)
    : io_(io), name_(std::move(name)), path_(std::move(socket)), session_end_(io), subscriptions_(name_) {}

json InstanceProxy::listing() const {
  const char* const state = state_ == InstanceState::kRunning   ? "running"
                            : state_ == InstanceState::kStopped ? "stopped"
                                                                : "gone";
  return {{"name", name_}, {"state", state}, {"axes", axes_}};
}

asio::awaitable<void> InstanceProxy::run() {
  asio::co_spawn(io_, expire(), asio::detached);
  asio::steady_timer pause(io_);
  ServiceRunId ended;  // the service run that closed the last connection
  auto ended_at = std::chrono::steady_clock::now();
  for (;;) {
    const ServiceRunId now = service_run_id(path_);
    const bool ending = ended && now == ended && std::chrono::steady_clock::now() < ended_at + kStopTime;
    if (config::would_start(path_)) {
      set_state(InstanceState::kStopped);
    } else if (!ending) {
      const bool was_connected = co_await session();
      disconnected();
      if (was_connected) {
        ended = now;
        ended_at = std::chrono::steady_clock::now();
      }
    }
    pause.expires_after(scaled(kRetry));
    co_await pause.async_wait(kUse);
  }
}

// Ends when one of the connections ends. Returns false if none was established.
asio::awaitable<bool> InstanceProxy::session() {
  session_end_.expires_at(asio::steady_timer::time_point::max());
  for (Connection* const connection : connections_) {
    *connection = std::make_shared<client::AsyncConnection>(io_);
    (*connection)
        ->open(
            path_, [this](std::string_view line) { on_line(line); }, [this](const std::string&) { end_session(); });
  }
  short_->call("status", "{}", [this](std::string_view member) { update_axes(member); });
  co_await session_end_.async_wait(kUse);
  co_return std::any_of(connections_.begin(), connections_.end(),
                        [](const Connection* connection) { return (*connection)->was_connected(); });
}

void InstanceProxy::end_session() { session_end_.expires_at(asio::steady_timer::time_point::min()); }

void InstanceProxy::on_line(std::string_view line) {
  const Notification notification = notification_of(line);
  if (notification.method.empty()) return;
  if (on_notification) on_notification(notification);
  subscriptions_.put(notification);
}

// The state becomes kRunning only when the axes are known.
void InstanceProxy::update_axes(std::string_view member) {
  const client::Response status = client::response_of_member("status", member);
  report_older(!status && status.error().code == kFailed ? status.error().text() : "");
  if (!status) return end_session();
  axes_.clear();
  for (const auto& [axis, own] : (*status)["axes"].items()) axes_.push_back(axis);
  subscribe_to_notifications();
}

// Once, not at each reconnect.
void InstanceProxy::report_older(const std::string& why) {
  if (std::exchange(status_problem_, why) != why && !why.empty()) fmt::print(stderr, "prismweb: {}: {}\n", name_, why);
}

// Subscribes before on_connect() requests past rows, so that no second is missed.
void InstanceProxy::subscribe_to_notifications() {
  notifications_->call("subscribe", R"({"streams":["window","event"]})", [this](std::string_view member) {
    if (!member.starts_with(R"("result")")) return end_session();
    state_ = InstanceState::kRunning;
    subscribed_every_ = 0;
    subscribing_ = false;
    send_subscription();
    if (on_change) on_change();
    if (on_connect) on_connect();
  });
}

// One request at a time; its callback sends later changes.
void InstanceProxy::send_subscription() {
  const std::uint32_t every = subscriptions_.sample_every();
  if (state_ != InstanceState::kRunning || subscribing_ || every == subscribed_every_) return;
  subscribing_ = true;
  subscribed_every_ = every;
  notifications_->call(
      every > 0 ? "subscribe" : "unsubscribe",
      every > 0 ? fmt::format(R"({{"streams":["sample"],"every":{}}})", every) : R"({"streams":["sample"]})",
      [this](std::string_view) {
        subscribing_ = false;
        send_subscription();
      });
}

void InstanceProxy::subscribe(Subscriber* subscriber, const Subscription& subscription) {
  subscriptions_.set(subscriber, subscription);
  send_subscription();
}

void InstanceProxy::call(std::string_view method, const nlohmann::json& params, Answer answer) {
  if (state_ != InstanceState::kRunning) return answer(error_member(kGone, name_ + " is not running"));
  const std::string text = params.is_null() ? "{}" : json_text(params);
  if (text.size() > kMaxParamsBytes)
    return answer(error_member(
        kInvalidParams, fmt::format("found params of {} bytes, expected at most {}", text.size(), kMaxParamsBytes)));
  if (!(is_long(method) ? long_ : short_)->call(method, text, answer))
    answer(error_member(kBusy, "too many requests pending for " + name_ + "; retry later"));
}

asio::awaitable<void> InstanceProxy::expire() {
  asio::steady_timer tick(io_);
  const std::string member = error_member(kTimeout, fmt::format("{} did not respond within {} s", name_,
                                                                client::AsyncConnection::kResponseTimeout.count()));
  for (;;) {
    tick.expires_after(std::chrono::seconds(1));
    co_await tick.async_wait(kUse);
    for (Connection* const connection : connections_) {
      if (*connection) (*connection)->expire(member);
    }
  }
}

void InstanceProxy::disconnected() {
  set_state(InstanceState::kGone);
  const std::string member = error_member(kGone, name_ + " disconnected");
  for (Connection* const connection : connections_) (*connection)->end(member);
}

void InstanceProxy::set_state(InstanceState state) {
  if (std::exchange(state_, state) != state && on_change) on_change();
}

}  // namespace prism::prismweb
