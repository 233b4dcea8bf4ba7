// SPDX-License-Identifier: MIT
// A connection to a prismd that waits for nothing: requests and notifications as they come.
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

/// Its functions are called from the io_context, never from within its own calls; after close() none of them.
class LineClient : public std::enable_shared_from_this<LineClient> {
 public:
  using Message = std::function<void(const nlohmann::json& message)>;  ///< as it came, with result, error or method
  using Gone = std::function<void(const std::string& why)>;

  explicit LineClient(boost::asio::io_context& context) : socket_(context) {}

  /// Connects, then reads until close() or until prismd goes: `gone` once.
  void open(const std::string& path, Message notification, Gone gone);
  /// `answer` gets the whole message.
  void ask(const char* method, const nlohmann::json& params, Message answer);
  void close();
  bool is_open() const { return open_; }

 private:
  void read();
  void write();
  void take(std::string_view line);
  void lost(const std::string& why);

  boost::asio::local::stream_protocol::socket socket_;
  std::string received_;
  std::deque<std::string> unsent_;
  std::map<int, Message> asked_;
  Message notification_;
  Gone gone_;
  int last_id_ = 0;
  bool open_ = false, connected_ = false;

  static constexpr std::size_t kLineMax = 8 << 20;     // a page of rows has 256 KiB
  static constexpr std::size_t kKeptBytes = 32 << 10;  // of the buffer, between lines: there may be a thousand of us
};

}  // namespace prism::prismrelay
