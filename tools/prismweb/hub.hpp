// SPDX-License-Identifier: MIT
// The one connection to a prismd, which serves all clients of prismweb.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tools/prismweb/topics.hpp"

namespace prism::prismweb {

inline constexpr int kNoMethod = -32601, kWrongParams = -32602, kNotDone = -32000, kNotRunning = -32003,
                     kTooMuch = -32004;

/// `"error":{"code":…,"message":…}`, a member of an answer.
std::string error_member(int code, const std::string& message);

enum class HubState { kGone, kStopped, kRunning };

class Hub {
 public:
  /// Takes what prismd answered, the member `"result":…` or `"error":{…}`, valid during the call.
  using Answer = std::function<void(std::string_view member)>;

  Hub(boost::asio::io_context& io, std::string name, std::string socket);
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// Connects, and connects again, until the context ends. Never where that would start an instance that somebody
  /// stopped.
  boost::asio::awaitable<void> run();

  /// Asks prismd. The answer comes later, or at once where it does not run or the params are longer than any that
  /// prismd takes; an error after 15 s of silence. `rows`, of which prismd takes one at a time, wait for each other.
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
  using Protocol = boost::asio::local::stream_protocol;
  using Clock = std::chrono::steady_clock;
  struct Waiting {
    Answer answer;
    Clock::time_point until;
    bool rows;
  };
  struct Queued {
    std::string params;
    Answer answer;
  };

  boost::asio::awaitable<void> session();
  boost::asio::awaitable<void> expire();
  void send(std::string_view method, const std::string& params, Answer answer);
  void send_line(std::string line);
  void write_next();
  void read_line(std::string_view line);
  void next_rows();
  void subscribe();
  void learn_axes();
  void disconnected();
  void become(HubState state);

  boost::asio::io_context& io_;
  std::string name_, path_;
  Protocol::socket socket_;
  HubState state_ = HubState::kGone;
  std::vector<std::string> axes_;
  Topics topics_;
  std::map<std::uint64_t, Waiting> waiting_;
  std::deque<Queued> rows_;
  bool rows_under_way_ = false;
  std::uint64_t last_id_ = 0;
  std::uint32_t subscribed_every_ = 0;
  std::deque<std::string> outgoing_;
  bool writing_ = false;
};

}  // namespace prism::prismweb
