// SPDX-License-Identifier: MIT
// Publishes live state for dashboards to an MQTT broker. Lost messages are not sent again, except the last value of
// each topic.
#pragma once

#include <mosquitto.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "tools/prismrelay/settings.hpp"
#include "tools/prismrelay/state.hpp"

namespace prism::prismrelay {

/// One connection with its own thread; reconnects without limit. QoS 1. PREFIX/SITE/relay (retained) is "online"; the
/// broker sets it to "offline" if the connection is lost. The broker is reported as up after its first acknowledgement,
/// and as down if it acknowledges no message for kAckTimeout; then the connection is renewed.
class Mqtt {
 public:
  static constexpr std::chrono::seconds kAckTimeout{40};
  /// From the connection to take_retained().
  static constexpr std::chrono::seconds kRetainedWait{5};
  using GyroAndAxis = std::pair<std::string, std::string>;

  Mqtt(const MqttSettings& settings, const std::string& site, RelayState& state);
  ~Mqtt();
  Mqtt(const Mqtt&) = delete;
  Mqtt& operator=(const Mqtt&) = delete;

  /// Publishes on PREFIX/SITE/`topic`. Stores the last value of each topic, and publishes it as soon as the connection
  /// allows, and again after a reconnection.
  void publish_last(const std::string& topic, const std::string& text, bool retained);
  /// Publishes if connected; else counts the message as dropped.
  void publish_once(const std::string& topic, const std::string& text);
  /// Axes whose status the broker had retained, other than "gone", when the relay connected. Returns them once per
  /// connection, kRetainedWait after its start; else returns nothing.
  std::set<GyroAndAxis> take_retained();
  /// Publishes "offline" and disconnects. Call at the end of the program.
  void finish();

 private:
  struct Last {
    std::string text;
    bool retained = false, sent = false;
  };
  struct Free {
    void operator()(mosquitto* client) const { mosquitto_destroy(client); }
  };
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxInFlight = 1000;           ///< messages not acknowledged by the broker
  static constexpr std::size_t kMaxRetained = 10000;  ///< axes of take_retained()

  void loop();
  std::string run_connection();
  std::string prepare();
  static void set_callbacks(mosquitto* client);
  void connected(int code);
  void disconnected(int code);
  void acknowledged();
  void on_message(const mosquitto_message& message);
  void send_unsent();
  bool is_silent(Clock::time_point now);
  bool send(const std::string& topic, const std::string& text, bool retained);

  const MqttSettings settings_;
  const std::string base_;  ///< PREFIX/SITE/
  RelayState& state_;
  std::string reason_;  ///< of the end of the connection; only of the thread
  std::atomic<bool> stopping_ = false;
  std::mutex mutex_;  ///< for all below
  std::unique_ptr<mosquitto, Free> client_;
  std::map<std::string, Last> last_;
  std::set<GyroAndAxis> retained_;
  Clock::time_point retained_due_, last_ack_;  ///< last_ack_: or the first message without acknowledgement
  int in_flight_ = 0;
  bool up_ = false, retained_taken_ = false;
  std::thread thread_;
};

/// Returns true if `name` is valid as a level of a topic: it follows TextRule::kName, without the wildcards + and # and
/// without a leading $, which brokers reserve.
bool is_topic_part(const std::string& name);

}  // namespace prism::prismrelay
