// SPDX-License-Identifier: MIT
// What prismd says now: for the broker and the metrics. A thread of its own: a database that stands still holds up
// nothing here.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "tools/prismrelay/instance_client.hpp"
#include "tools/prismrelay/mqtt.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

class LiveLoop {
 public:
  static constexpr std::size_t kLoop = 1;  ///< its place in RelayState's progress

  LiveLoop(const Settings& settings, RelayState& state);
  void run();
  void stop();

 private:
  struct Source {
    std::shared_ptr<InstanceClient> instance;
    bool asked = false;  ///< a status is on its way
    std::set<std::string> axes;
  };
  void discover();
  void follow(const std::string& gyro, const std::string& name, const std::string& socket);
  void told(const std::string& name, const std::set<std::string>& axes, const nlohmann::json& notification);
  void take_status(const std::string& gyro, const std::string& name, nlohmann::json status);
  void publish_offline(const std::string& name, const std::set<std::string>& axes, const std::string& state);
  void once_a_second();

  const Settings& settings_;
  RelayState& state_;
  boost::asio::io_context context_;
  boost::asio::steady_timer second_timer_;
  std::unique_ptr<Mqtt> mqtt_;
  std::map<std::string, Source> sources_;
  std::set<std::string> refused_;  ///< names that are no part of a topic
  unsigned second_ = 0;
};

}  // namespace prism::prismrelay
