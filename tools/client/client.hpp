// SPDX-License-Identifier: MIT
// The client of one prismd: reconnects, sends one request at a time, passes on notifications; responses and their
// parts.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "base/result.hpp"
#include "config/socket_protocol.hpp"

namespace prism::client {

struct RequestError {
  config::SocketError code;  ///< prismd's; kGone: no connection; kTimeout: no response
  Error error;

  std::string text() const { return error.text(); }
};

using Response = tl::expected<nlohmann::json, RequestError>;

/// Returns the result in `message`, a response to `method`. Errors: that of the response; kFailed if the result has the
/// form of protocol 1, because this prismd is older.
Response response_of(std::string_view method, nlohmann::json message);

/// The same for the member `"result":…` or `"error":{…}` of the message.
Response response_of_member(std::string_view method, std::string_view member);

/// Returns `"error":{"code":…,"message":…}`, a member of a response.
std::string error_member(int code, const std::string& message);

/// The part of a result that belongs to `axis`; of the only axis if it is empty; null if it does not exist.
const nlohmann::json& of_axis(const nlohmann::json& result, const std::string& axis);

/// Returns a result with the members of `axis` in the result itself, and those of its `log` in the log of all.
nlohmann::json with_axis(nlohmann::json result, const std::string& axis);

/// Errors are values, not exceptions.
inline constexpr auto kUse = boost::asio::as_tuple(boost::asio::use_awaitable);

/// kGone: no connection. kStopped: systemd would start the instance at a connection.
enum class State { kGone, kStopped, kConnected };

/// prismd disconnects a client with more than a few pending responses, and drops rows for a client with unread
/// responses. So a request is sent after the response to the previous one: use one client for long requests, and one
/// for short requests and notifications. Use it on the thread of `io` only. It must outlive run() and once(), but not
/// ask() and ask_text().
class Client {
 public:
  /// The work on one connection, which ends when this returns, with the reason that it returns. If the connection ends
  /// first, requests return kGone and this coroutine is cancelled at its next co_await.
  using Session = std::function<boost::asio::awaitable<std::string>()>;

  Client(boost::asio::io_context& io, std::string socket, std::chrono::milliseconds timeout = kTimeout);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { fail_requests(); }

  /// Connects, runs `session`, and repeats this after a pause, until close(). The pause grows from 0.5 s to 2 s while
  /// prismd does not respond. Never starts a stopped instance, but the first time if `may_start`.
  boost::asio::awaitable<void> run(Session session, bool may_start = false);

  /// Connects and runs `session` once; systemd starts a stopped instance. Returns the reason of the end: the result of
  /// `session`, or an error text.
  boost::asio::awaitable<std::string> once(Session session);

  /// Ends the connection with a reason; run() connects again.
  void end(const std::string& reason);
  /// Ends the connection; run() returns.
  void close();

  /// Sends a request when the previous ones have their responses, from within a session or from outside. Returns
  /// `"result":…` or `"error":{…}`, a member of the response. `params`: JSON. Errors: kGone (no connection), kBusy (too
  /// many requests are pending), kTimeout (no response within the timeout; if prismd had received the request, the
  /// connection ends).
  boost::asio::awaitable<std::string> ask_text(std::string method, std::string params = "{}");
  /// The same with parsed JSON. g++ 12 destroys braces in a co_await statement twice: give `params` a name.
  boost::asio::awaitable<Response> ask(std::string method, nlohmann::json params = nullptr);

  State state() const { return state_; }
  const std::string& name() const { return name_; }  ///< of the instance
  const std::string& socket() const { return path_; }

  /// Called with each notification; must not destroy the client.
  std::function<void(std::string_view line)> on_notification;
  /// Called after the end of each connection, after each failed attempt to connect, and at each attempt while the
  /// instance is stopped. `state`: kGone or kStopped.
  std::function<void(State state, const std::string& reason)> on_end;

  static constexpr std::chrono::milliseconds kTimeout{15'000};

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMinRoom = 2 << 10;
  struct Request;

  boost::asio::awaitable<std::string> read();
  std::string take_lines();
  std::string take_line(std::string_view line);
  void adapt_room(std::size_t read_bytes);
  void send_next();
  void drop(const std::shared_ptr<Request>& request);
  void fail_requests();

  boost::asio::io_context& io_;
  const std::string path_, name_;
  const std::chrono::milliseconds timeout_;
  boost::asio::local::stream_protocol::socket socket_;
  boost::asio::steady_timer pause_;
  State state_ = State::kGone;
  bool closed_ = false;
  bool answered_ = false;         ///< this connection had a response
  bool ended_by_prismd_ = false;  ///< as opposed to end() and the session's return
  std::string end_reason_;        ///< of end()
  std::string received_;
  std::size_t searched_ = 0;     ///< bytes of received_ without a line end
  std::size_t room_ = kMinRoom;  ///< for the next read
  std::deque<std::shared_ptr<Request>> requests_;
  std::uint64_t last_id_ = 0, sent_id_ = 0;  ///< sent_id_: of the first request, if it was sent; else 0
  Clock::time_point sent_at_;
};

/// Connects, and runs `work` on this thread to its end; systemd starts a stopped instance. Errors: no connection, its
/// end before that of `work`, those of `work`.
using Work = std::function<boost::asio::awaitable<Result<void>>(Client& client)>;
Result<void> connected(const std::string& socket, const Work& work);

}  // namespace prism::client
