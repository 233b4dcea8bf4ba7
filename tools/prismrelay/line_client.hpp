// SPDX-License-Identifier: MIT
// Non-blocking connection to a prismd: requests and notifications.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace prism::prismrelay {

/// Callbacks run from the io_context, never within a call of a member function, and not after close().
class LineClient : public std::enable_shared_from_this<LineClient> {
 public:
  using OnMessage = std::function<void(const nlohmann::json& message)>;  ///< complete, with result, error or method
  using OnDisconnect = std::function<void(const std::string& reason)>;

  explicit LineClient(boost::asio::io_context& context) : socket_(context) {}

  /// Connects and reads until close() or an error, which calls `on_disconnect` once.
  void open(const std::string& path, OnMessage on_notification, OnDisconnect on_disconnect);
  /// Sends a request, as soon as the connection is established.
  void call(const char* method, const nlohmann::json& params, OnMessage on_response);
  void close();
  bool is_open() const { return open_; }

 private:
  void read();
  void write();
  void on_line(std::string_view line);
  void disconnect(const std::string& reason);

  boost::asio::local::stream_protocol::socket socket_;
  std::string received_;
  std::deque<std::string> unsent_;
  std::map<int, OnMessage> pending_;  ///< by id of the request
  OnMessage on_notification_;
  OnDisconnect on_disconnect_;
  int last_id_ = 0;
  bool open_ = false, connected_ = false;

  static constexpr std::size_t kMaxLineBytes = 8 << 20;      // a page of rows has 256 KiB
  static constexpr std::size_t kIdleBufferBytes = 32 << 10;  // capacity kept between lines: there may be 1000 clients
};

}  // namespace prism::prismrelay
