// SPDX-License-Identifier: MIT
// A connection to prismd that sends one request at a time.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>

#include "config/socket_protocol.hpp"

namespace prism::prismweb {

/// prismd disconnects a client with more than a few pending responses, and drops rows for a client with unread
/// responses. So a request is sent after the response to the previous one, and long requests, short requests and
/// notifications have a connection each.
class RequestConnection {
 public:
  /// Is called with the member `"result":…` or `"error":{…}` of the response, valid during the call.
  using Answer = std::function<void(std::string_view member)>;
  using OnLine = std::function<void(std::string_view line)>;

  RequestConnection(boost::asio::io_context& io, std::string path);
  RequestConnection(const RequestConnection&) = delete;
  RequestConnection& operator=(const RequestConnection&) = delete;

  /// Returns false if the connection failed.
  boost::asio::awaitable<bool> connect();
  /// Reads until the connection ends. Calls `on_other_line` with each line that is not a response.
  boost::asio::awaitable<void> read(OnLine on_other_line);
  void close();

  /// `params`: JSON. `protocol`: form of the result, 1 or 2. Returns false if 256 requests are pending.
  bool call(std::string_view method, const std::string& params, Answer answer, int protocol = config::kProtocol);
  /// Calls the callbacks of requests older than 15 s with `member` and removes these requests, except the one that was
  /// sent: the next one is sent after its response.
  void expire(std::string_view member);
  /// Closes the connection and calls all callbacks with `member`.
  void end(std::string_view member);

 private:
  using Protocol = boost::asio::local::stream_protocol;
  using Clock = std::chrono::steady_clock;
  struct PendingRequest {
    std::string method, params;
    Answer answer;  ///< null: expired
    Clock::time_point until;
    int protocol;
  };

  void next();
  void read_line(std::string_view line, const OnLine& on_other_line);

  boost::asio::io_context& io_;
  std::string path_;
  Protocol::socket socket_;
  std::deque<PendingRequest> pending_;
  std::uint64_t last_id_ = 0, current_id_ = 0;  ///< current_id_: of the sent request; 0: none
  std::string line_;
  bool writing_ = false;
};

/// Pending requests expire after this time.
inline constexpr std::chrono::seconds kResponseTimeout{15};

}  // namespace prism::prismweb
