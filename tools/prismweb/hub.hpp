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

#include "tools/prismweb/lane.hpp"
#include "tools/prismweb/topics.hpp"

namespace prism::prismweb {

inline constexpr int kNoMethod = -32601, kWrongParams = -32602, kNotDone = -32000, kNotRunning = -32003,
                     kTooMuch = -32004;

/// `"error":{"code":…,"message":…}`, a member of an answer.
std::string error_member(int code, const std::string& message);

enum class HubState { kGone, kStopped, kRunning };

class Hub {
 public:
  using Answer = Lane::Answer;

  Hub(boost::asio::io_context& io, std::string name, std::string socket);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// Connects, and connects again, until the context ends. Never where that would start an instance that somebody
  /// stopped.
  boost::asio::awaitable<void> run();

  /// Asks prismd. The answer comes later, or at once where it does not run, too many wait or the params are longer than
  /// any that prismd takes; an error after 15 s of silence. One question follows the other; those with long answers
  /// (`rows`, `history`, `events`) hold up no short one.
  void ask(std::string_view method, const nlohmann::json& params, Answer answer);

  void wish(Subscriber* who, const Wish& wish);
  Topics& topics() { return topics_; }

  const std::string& name() const { return name_; }
  HubState state() const { return state_; }
  const std::vector<std::string>& axes() const { return axes_; }
  nlohmann::json listing() const;  ///< {"name","state","axes"}

  std::function<void()> on_change;                           ///< state or axes are others
  std::function<void()> on_connect;                          ///< prismd has told its axes
  std::function<void(const Notification&)> on_notification;  ///< each, before it is batched

 private:
  boost::asio::awaitable<bool> connect();
  boost::asio::awaitable<void> session();
  boost::asio::awaitable<void> expire();
  void hear(std::string_view line);
  void learn(std::string_view status);
  void listen();
  void subscribe();
  void disconnected();
  void become(HubState state);

  boost::asio::io_context& io_;
  std::string name_, path_;
  Lane short_, long_, ears_;
  const std::array<Lane*, 3> lanes_{&ears_, &short_, &long_};
  HubState state_ = HubState::kGone;
  std::vector<std::string> axes_;
  Topics topics_;
  std::uint32_t subscribed_every_ = 0;
  bool subscribing_ = false;
};

}  // namespace prism::prismweb
