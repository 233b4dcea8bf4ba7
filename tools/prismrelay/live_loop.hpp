// SPDX-License-Identifier: MIT
// Sends current windows, events and status to the MQTT broker and the metrics. Has its own thread, so that a blocked
// database does not delay it.
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
  static constexpr std::size_t kLoop = 1;  ///< index in RelayState::progress()

  LiveLoop(const Settings& settings, RelayState& state);
  void run();
  void stop();

 private:
  struct Source {
    std::shared_ptr<InstanceClient> instance;
    bool status_pending = false;
    std::set<std::string> axes;
  };
  void follow(const std::string& gyro, const std::string& name, const std::string& socket);
  void on_notification(const std::string& name, const std::set<std::string>& axes, const nlohmann::json& notification);
  void on_status(const std::string& gyro, const std::string& name, nlohmann::json status);
  void publish_offline(const std::string& name, const std::set<std::string>& axes, const std::string& state);
  void replace_retained();
  void once_a_second();

  const Settings& settings_;
  RelayState& state_;
  boost::asio::io_context context_;
  boost::asio::steady_timer second_timer_;
  std::unique_ptr<Mqtt> mqtt_;
  std::map<std::string, Source> sources_;
  std::set<std::string> unpublished_;  ///< names that are invalid in a topic
  unsigned second_ = 0;
};

}  // namespace prism::prismrelay
