// SPDX-License-Identifier: MIT
// Live state for dashboards, at an MQTT broker. Never the ledger: what a broker loses is gone.
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

/// One connection, on a thread of its own; reconnects for ever. QoS 1. Under PREFIX/SITE/relay stands "online",
/// or, by the broker's own hand when we are gone, "offline" (retained).
class Mqtt {
 public:
  Mqtt(const MqttSettings& settings, const std::string& site, RelayState& state);
  ~Mqtt();
  Mqtt(const Mqtt&) = delete;
  Mqtt& operator=(const Mqtt&) = delete;

  /// Where the connection could not even be begun (no password to be read, no certificate): tries again.
  void retry();
  /// The last value of a topic is kept, and told again when the broker is there again. `topic` goes behind
  /// PREFIX/SITE/.
  void publish_last(const std::string& topic, const std::string& text, bool retained);
  /// Told once, to a broker that is there; else counted as dropped.
  void publish_once(const std::string& topic, const std::string& text);
  /// Says "offline" itself and disconnects, as at the end of the program.
  void finish();

 private:
  struct Last {
    std::string text;
    bool retained;
  };
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };
  static constexpr int kMostInFlight = 1000;  ///< messages that the broker has not acknowledged

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
  bool up_ = false, began_ = false;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};

/// True if a name may be one level of a topic: it follows TextRule::kName, without + and #, which are wildcards, and
/// without a leading $, which brokers reserve.
bool is_topic_part(const std::string& name);

}  // namespace prism::prismrelay
