// SPDX-License-Identifier: MIT
// Publishes live state for dashboards to an MQTT broker. Lost messages are not sent again, except the last value of
// each topic.
#pragma once

#include <mosquitto.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tools/prismrelay/settings.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// One connection with its own thread; reconnects without limit. QoS 1. PREFIX/SITE/relay (retained) is "online"; the
/// broker sets it to "offline" if the connection is lost.
class Mqtt {
 public:
  Mqtt(const MqttSettings& settings, const std::string& site, RelayState& state);
  ~Mqtt();
  Mqtt(const Mqtt&) = delete;
  Mqtt& operator=(const Mqtt&) = delete;

  /// Starts the connection if that failed before, e.g. because the password or certificate was unreadable.
  void retry();
  /// Publishes on PREFIX/SITE/`topic`. Stores the last value of each topic and publishes it again after a reconnection.
  void publish_last(const std::string& topic, const std::string& text, bool retained);
  /// Publishes if connected; else counts the message as dropped.
  void publish_once(const std::string& topic, const std::string& text);
  /// Publishes "offline" and disconnects. Call at the end of the program.
  void finish();

 private:
  struct Last {
    std::string text;
    bool retained;
  };
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };
  static constexpr int kMaxInFlight = 1000;  ///< messages not acknowledged by the broker

  void loop();
  void connected(int code);
  void disconnected(int code);
  bool send(const std::string& topic, const std::string& text, bool retained);

  const MqttSettings settings_;
  const std::string base_;  ///< PREFIX/SITE/
  RelayState& state_;
  std::unique_ptr<mosquitto, Free> client_;
  std::mutex mutex_;
  std::map<std::string, Last> last_;
  int in_flight_ = 0;
  bool up_ = false, started_ = false;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

/// Returns true if `name` is valid as a level of a topic: it follows TextRule::kName, without the wildcards + and # and
/// without a leading $, which brokers reserve.
bool is_topic_part(const std::string& name);

}  // namespace prism::prismrelay
