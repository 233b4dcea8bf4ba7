// SPDX-License-Identifier: MIT
// A connection to prismd on which one question follows the other.
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

namespace prism::prismweb {

/// prismd closes a client for which more than a few answers wait, and leaves out rows for one whose answers wait to be
/// read. So a question goes when the last one was answered, and what is long, what is short and what comes by itself
/// have a connection each.
class RequestConnection {
 public:
  /// Takes what prismd answered, the member `"result":…` or `"error":{…}`, valid during the call.
  using Answer = std::function<void(std::string_view member)>;
  using Other = std::function<void(std::string_view line)>;

  RequestConnection(boost::asio::io_context& io, std::string path);
  RequestConnection(const RequestConnection&) = delete;
  RequestConnection& operator=(const RequestConnection&) = delete;

  /// False where nobody listens.
  boost::asio::awaitable<bool> connect();
  /// Until the connection ends; `other` takes each line that answers nothing.
  boost::asio::awaitable<void> read(Other other);
  void close();

  /// `params`: JSON. False where so many wait already that this one is not taken.
  bool ask(std::string_view method, const std::string& params, Answer answer);
  /// Answers with `member` what has waited for 15 s. What is under way stays so: nothing is laid behind it.
  void expire(std::string_view member);
  /// Answers everything with `member`.
  void end(std::string_view member);

 private:
  using Protocol = boost::asio::local::stream_protocol;
  using Clock = std::chrono::steady_clock;
  struct PendingRequest {
    std::string method, params;
    Answer answer;  ///< none: it has expired
    Clock::time_point until;
  };

  void next();
  void read_line(std::string_view line, const Other& other);

  boost::asio::io_context& io_;
  std::string path_;
  Protocol::socket socket_;
  std::deque<PendingRequest> pending_;
  std::uint64_t last_id_ = 0, current_id_ = 0;  ///< the first question's id; 0: none is under way
  std::string line_;
  bool writing_ = false;
};

/// How long an answer is waited for.
inline constexpr std::chrono::seconds kResponseTimeout{15};

}  // namespace prism::prismweb
