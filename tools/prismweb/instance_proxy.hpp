// SPDX-License-Identifier: MIT
// All connections of prismweb to one prismd, shared by its clients.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "config/socket_protocol.hpp"
#include "tools/client/async_connection.hpp"
#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

using enum config::SocketError;

/// Returns `"error":{"code":…,"message":…}`, a member of a response.
std::string error_member(int code, const std::string& message);

enum class InstanceState { kGone, kStopped, kRunning };

class InstanceProxy {
 public:
  using Answer = client::AsyncConnection::Answer;

  InstanceProxy(boost::asio::io_context& io, std::string name, std::string socket);
  InstanceProxy(const InstanceProxy&) = delete;
  InstanceProxy& operator=(const InstanceProxy&) = delete;

  /// Connects, and reconnects after each disconnection, until the context ends. Does not connect to the socket of a
  /// stopped service, because that would start it.
  boost::asio::awaitable<void> run();

  /// Calls a method of prismd. Errors at once: prismd is not running, too many requests are pending, the params are too
  /// long. Error after 15 s: no response. Requests are sent one at a time; those with long responses (`rows`,
  /// `history`, `events`) have a connection of their own, so that they do not delay short ones.
  void call(std::string_view method, const nlohmann::json& params, Answer answer);

  void subscribe(Subscriber* subscriber, const Subscription& subscription);
  SubscriptionTable& subscriptions() { return subscriptions_; }

  const std::string& name() const { return name_; }
  InstanceState state() const { return state_; }
  const std::vector<std::string>& axes() const { return axes_; }
  nlohmann::json listing() const;  ///< {"name","state","axes"}

  std::function<void()> on_change;                           ///< the state or the axes changed
  std::function<void()> on_connect;                          ///< connected, and the axes are known
  std::function<void(const Notification&)> on_notification;  ///< each notification, before batching

 private:
  using Connection = std::shared_ptr<client::AsyncConnection>;

  boost::asio::awaitable<bool> session();
  void end_session();
  boost::asio::awaitable<void> expire();
  void on_line(std::string_view line);
  void update_axes(std::string_view status);
  void report_older(const std::string& why);
  void subscribe_to_notifications();
  void send_subscription();
  void disconnected();
  void set_state(InstanceState state);

  boost::asio::io_context& io_;
  std::string name_, path_;
  Connection short_, long_, notifications_;  ///< of the current session
  const std::array<Connection*, 3> connections_{&notifications_, &short_, &long_};
  boost::asio::steady_timer session_end_;
  InstanceState state_ = InstanceState::kGone;
  std::vector<std::string> axes_;
  SubscriptionTable subscriptions_;
  std::uint32_t subscribed_every_ = 0;
  bool subscribing_ = false;
  std::string status_problem_;  ///< why the last status was rejected
};

}  // namespace prism::prismweb
