// SPDX-License-Identifier: MIT
// The requests of all clients, in turns: whatever many ask and however much, the line waits for one slice at most.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/socket/client.hpp"
#include "daemon/socket/rpc.hpp"

namespace prism::socket {

/// Answers one line of each client in turn, a batch as one request after the other. After kSlice the loop looks at
/// everything else (the line, timers, sockets) before it goes on. What a client that is gone still wanted is dropped.
/// Lives on the live path's thread.
class RequestQueue {
 public:
  static constexpr std::chrono::microseconds kSlice{1000};

  RequestQueue(boost::asio::any_io_executor executor, Rpc& rpc) : executor_(std::move(executor)), rpc_(rpc) {}

  /// `lines`: whole lines without their ends. `done` is called when the last of them was answered, or dropped: the
  /// client reads no more until then.
  void add(std::shared_ptr<Client> client, std::deque<std::string> lines, std::function<void()> done);

 private:
  struct Entry {
    std::shared_ptr<Client> client;
    std::deque<std::string> lines;
    std::deque<nlohmann::json> requests;  // of the line last taken
    std::function<void()> done;
  };
  void post();
  void run();
  /// One request, or one line parsed. False: nothing is left.
  bool step(Entry& entry);

  boost::asio::any_io_executor executor_;
  Rpc& rpc_;
  std::deque<Entry> queue_;
  bool posted_ = false;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace prism::socket
