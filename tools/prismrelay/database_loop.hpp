// SPDX-License-Identifier: MIT
// From every log into the ledger, on a thread of its own.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/prismrelay/instance_client.hpp"
#include "tools/prismrelay/log_tailer.hpp"
#include "tools/prismrelay/row_database.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

class DatabaseLoop {
 public:
  static constexpr std::size_t kLoop = 0;  ///< its place in RelayState's progress

  DatabaseLoop(const Settings& settings, RelayState& state);
  /// Until stop().
  void run();
  /// From any thread. What is gathered is committed first, within the patience of a commit.
  void stop();

 private:
  struct Source {
    std::shared_ptr<InstanceClient> instance;
    std::vector<std::shared_ptr<LogTailer>> logs;
  };
  void connect();
  void failed(const Error& error);
  void discover();
  void follow(const std::string& gyro, const std::string& socket);
  void begun(Source& source, const nlohmann::json& status);
  void take_events(const std::string& gyro, const nlohmann::json& message);
  void gathered();
  void commit();
  void once_a_second();
  void keep_days();
  template <class Do>
  void each_log(Do&& act);

  const Settings& settings_;
  RelayState& state_;
  boost::asio::io_context context_;
  boost::asio::steady_timer commit_timer_, retry_timer_, second_timer_;
  RowDatabase database_;
  Batch batch_;
  RowTraffic traffic_;
  std::map<std::string, Source> sources_;
  std::chrono::milliseconds pause_;
  std::chrono::steady_clock::time_point last_talk_, days_kept_;
  bool waiting_ = false, asking_ = false;
};

}  // namespace prism::prismrelay
