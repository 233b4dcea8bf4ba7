// SPDX-License-Identifier: MIT
// Requests for log pages, read on the disk thread. A request at the end of the log may wait for new rows.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>

#include "daemon/pipeline/log_writers.hpp"
#include "daemon/socket/client.hpp"

namespace prism::socket {

/// Used on the live thread only. One request per client at a time.
class RowRequests {
 public:
  static constexpr double kLongestWait_s = 30;

  struct Request {
    std::shared_ptr<Client> client;
    pipeline::RowWriter* log;  ///< must outlive this
    pipeline::RowQuery query;
    double wait_s;  ///< max. wait for a first row, 0 to kLongestWait_s
    std::function<void(pipeline::RowResult)> answer;
  };

  /// Returns false without effect if a request of this client is pending.
  bool add(boost::asio::any_io_executor executor, Request request);
  /// Call after a sync: new rows may be on the disk.
  void synced();
  std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Entry {
    Entry(boost::asio::any_io_executor on, Request asked)
        : request(std::move(asked)), executor(on), timer(std::move(on)), until(Client::Clock::now()) {}
    Request request;
    boost::asio::any_io_executor executor;
    boost::asio::steady_timer timer;
    Client::Clock::time_point until;
    bool reading = false, asked_again = false;
  };
  using Entries = std::list<std::shared_ptr<Entry>>;

  void read(const std::shared_ptr<Entry>& entry);
  void take(const std::shared_ptr<Entry>& entry, pipeline::RowResult page);
  void end(const std::shared_ptr<Entry>& entry, pipeline::RowResult page);

  Entries waiting_;
  const std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace prism::socket
