// SPDX-License-Identifier: MIT
// Non-blocking connection to prismd: sends one request at a time and receives notifications.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "config/socket_protocol.hpp"

namespace prism::client {

/// prismd disconnects a client with more than a few pending responses, and drops rows for a client with unread
/// responses. So a request is sent after the response to the previous one; use a connection each for long requests,
/// short requests and notifications. Callbacks run from the io_context, except those that expire() and end() call;
/// never within open() or call(), and not after close().
class AsyncConnection : public std::enable_shared_from_this<AsyncConnection> {
 public:
  /// Gets the member `"result":…` or `"error":{…}` of the response, valid during the call.
  using Answer = std::function<void(std::string_view member)>;
  using OnLine = std::function<void(std::string_view line)>;
  using OnEnd = std::function<void(const std::string& reason)>;

  explicit AsyncConnection(boost::asio::io_context& io) : socket_(io) {}

  /// Connects and reads until close() or an error, which calls `on_end` once. Calls `on_other_line` with each line that
  /// is not a response.
  void open(const std::string& path, OnLine on_other_line, OnEnd on_end);
  void close();
  bool is_open() const { return open_; }
  /// True from the establishment on, also after the end.
  bool was_connected() const { return connected_; }

  /// Sends a request, as soon as the connection is established. `params`: JSON.
  /// Returns false if 256 requests are pending.
  bool call(std::string_view method, const std::string& params, Answer answer);
  /// Calls the callbacks of requests older than kResponseTimeout with `member` and removes these requests, except the
  /// one that was sent: the next one is sent after its response.
  void expire(std::string_view member);
  /// Closes the connection and calls all callbacks with `member`.
  void end(std::string_view member);

  static constexpr std::chrono::seconds kResponseTimeout{15};

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMinRoom = 2 << 10;
  struct PendingRequest {
    std::string method, params;
    Answer answer;  ///< null: expired
    Clock::time_point until;
  };

  void send_next();
  void read();
  void take_lines();
  void adapt_room(std::size_t read_bytes);
  void read_line(std::string_view line);
  void pass_on(std::string_view line);
  void disconnect(const std::string& reason);

  boost::asio::local::stream_protocol::socket socket_;
  OnLine on_other_line_;
  OnEnd on_end_;
  std::string received_;
  std::size_t searched_ = 0;     ///< bytes of received_ without a line end
  std::size_t room_ = kMinRoom;  ///< for the next read
  std::deque<PendingRequest> pending_;
  std::uint64_t last_id_ = 0, current_id_ = 0;  ///< current_id_: of the sent request; 0: none
  std::string line_;
  bool open_ = false, connected_ = false, writing_ = false;
};

}  // namespace prism::client
