// SPDX-License-Identifier: MIT
// Sends the rows of all logs to the database, on its own thread.
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
  static constexpr std::size_t kLoop = 0;  ///< index in RelayState::progress()

  DatabaseLoop(const Settings& settings, RelayState& state);
  /// Runs until stop().
  void run();
  /// Thread-safe. Commits the batch first, if the database is connected.
  void stop();

 private:
  struct Source {
    std::shared_ptr<InstanceClient> instance;
    std::vector<std::shared_ptr<LogTailer>> logs;
  };
  void connect();
  void on_error(const Error& error);
  void discover();
  void follow(const std::string& gyro, const std::string& socket);
  void on_connected(Source& source, const nlohmann::json& status);
  void add_events(const std::string& gyro, const client::Response& events);
  void schedule_commit();
  void commit();
  std::map<LogKey, Refusal> report(const std::vector<Refusal>& refusals);
  void once_a_second();
  void keep_days();
  template <class Action>
  void for_each_log(Action&& action);

  const Settings& settings_;
  RelayState& state_;
  boost::asio::io_context context_;
  boost::asio::steady_timer commit_timer_, retry_timer_, second_timer_;
  RowDatabase database_;
  Batch batch_;
  RowTraffic traffic_;
  std::map<std::string, Source> sources_;
  std::chrono::milliseconds retry_delay_;  ///< grows until a commit
  std::chrono::steady_clock::time_point last_contact_, partitions_checked_, retention_checked_;
  bool commit_scheduled_ = false, requests_scheduled_ = false;
  bool batch_failed_ = false;  ///< since the last commit: the server is reported as down until the next one
};

}  // namespace prism::prismrelay
