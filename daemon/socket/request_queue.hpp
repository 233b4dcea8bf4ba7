// SPDX-License-Identifier: MIT
// Requests of all clients, round robin. Any number of requests delays the line by one slice at most.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "daemon/socket/client.hpp"
#include "daemon/socket/rpc.hpp"

namespace prism::socket {

/// Handles one line of each client in turn, and a batch request by request. After kSlice it returns to the event loop
/// (line, timers, sockets) before it continues. Drops requests of disconnected clients. Used on the live thread only.
class RequestQueue {
 public:
  static constexpr std::chrono::microseconds kSlice{1000};

  RequestQueue(boost::asio::any_io_executor executor, Rpc& rpc) : executor_(std::move(executor)), rpc_(rpc) {}

  /// `lines`: complete lines without line ends. `done` is called when the last one was answered or dropped; until then
  /// no more requests are read from the client.
  void add(std::shared_ptr<Client> client, std::deque<std::string> lines, std::function<void()> done);

 private:
  struct Entry;
  void post();
  void run();
  /// Handles one request or parses one line. Returns false if the entry is finished.
  bool step(Entry& entry);

  boost::asio::any_io_executor executor_;
  Rpc& rpc_;
  std::deque<std::shared_ptr<Entry>> queue_;
  bool posted_ = false;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace prism::socket
