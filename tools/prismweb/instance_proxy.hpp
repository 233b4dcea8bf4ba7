// SPDX-License-Identifier: MIT
// What prismweb has to do with a prismd, for all its clients together.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tools/prismweb/request_connection.hpp"
#include "tools/prismweb/subscription_table.hpp"

namespace prism::prismweb {

inline constexpr int kNoMethod = -32601, kWrongParams = -32602, kNotDone = -32000, kNotRunning = -32003,
                     kTooMuch = -32004;

/// `"error":{"code":…,"message":…}`, a member of an answer.
std::string error_member(int code, const std::string& message);

enum class InstanceState { kGone, kStopped, kRunning };

class InstanceProxy {
 public:
  using Answer = RequestConnection::Answer;

  InstanceProxy(boost::asio::io_context& io, std::string name, std::string socket);
  InstanceProxy(const InstanceProxy&) = delete;
  InstanceProxy& operator=(const InstanceProxy&) = delete;

  /// Connects, and connects again, until the context ends. Never where that would start an instance that somebody
  /// stopped.
  boost::asio::awaitable<void> run();

  /// Asks prismd. The answer comes later, or at once where it does not run, too many wait or the params are longer than
  /// any that prismd takes; an error after 15 s of silence. One question follows the other; those with long answers
  /// (`rows`, `history`, `events`) hold up no short one.
  void ask(std::string_view method, const nlohmann::json& params, Answer answer);

  void subscribe(Subscriber* subscriber, const Subscription& subscription);
  SubscriptionTable& subscriptions() { return subscriptions_; }

  const std::string& name() const { return name_; }
  InstanceState state() const { return state_; }
  const std::vector<std::string>& axes() const { return axes_; }
  nlohmann::json listing() const;  ///< {"name","state","axes"}

  std::function<void()> on_change;                           ///< state or axes are others
  std::function<void()> on_connect;                          ///< prismd has told its axes
  std::function<void(const Notification&)> on_notification;  ///< each, before it is batched

 private:
  boost::asio::awaitable<bool> connect();
  boost::asio::awaitable<void> session();
  boost::asio::awaitable<void> expire();
  void on_line(std::string_view line);
  void update_axes(std::string_view status);
  void listen();
  void send_subscription();
  void disconnected();
  void become(InstanceState state);

  boost::asio::io_context& io_;
  std::string name_, path_;
  RequestConnection short_, long_, notifications_;
  const std::array<RequestConnection*, 3> connections_{&notifications_, &short_, &long_};
  InstanceState state_ = InstanceState::kGone;
  std::vector<std::string> axes_;
  SubscriptionTable subscriptions_;
  std::uint32_t subscribed_every_ = 0;
  bool subscribing_ = false;
};

}  // namespace prism::prismweb
