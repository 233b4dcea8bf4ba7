// SPDX-License-Identifier: MIT
// Publishes live state for dashboards to an MQTT broker. Lost messages are not sent again, except the last value of
// each topic.
#pragma once

#include <mosquitto.h>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "tools/prismrelay/relay.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Returns true if `name` is valid as a level of a topic: it follows TextRule::kName, without the wildcards + and # and
/// without a leading $, which brokers reserve.
bool is_topic_part(const std::string& name);

/// Status or window of an axis that does not run, as JSON.
std::string gone_text(const std::string& axis);

/// One connection, QoS 1. PREFIX/SITE/relay (retained) is "online"; the broker sets it to "offline" if the connection
/// is lost. The target is up after the broker's first acknowledgement, and down if it acknowledges no message for 40 s;
/// then the connection is renewed. Statuses that the broker had retained, of axes without a value in this run, become
/// "gone" 5 s after the connection.
class Mqtt {
 public:
  Mqtt(boost::asio::io_context& io, const MqttSettings& settings, const std::string& site, Target& target);

  /// Connects, and reconnects after a loss, until finish(); then stops the io_context.
  boost::asio::awaitable<void> run();
  /// Publishes on PREFIX/SITE/`topic`. Stores the last value of each topic, and publishes it as soon as the connection
  /// allows, and again after a reconnection.
  void publish_last(const std::string& topic, const std::string& text, bool retained);
  /// Publishes if connected; else counts the message as dropped.
  void publish_once(const std::string& topic, const std::string& text);
  /// Publishes "offline" and disconnects; run() ends within 5 s.
  void finish();

 private:
  struct Last {
    std::string text;
    bool retained = false, sent = false;
  };
  using Clock = std::chrono::steady_clock;

  boost::asio::awaitable<std::string> run_connection();
  std::string prepare();
  void set_callbacks();
  void connected();
  void on_message(const mosquitto_message& message);
  void replace_retained();
  void send_unsent();
  bool send(const std::string& topic, const std::string& text, bool retained);

  boost::asio::io_context& io_;
  const MqttSettings settings_;
  const std::string base_;  ///< PREFIX/SITE/
  Target& target_;
  std::unique_ptr<mosquitto, decltype(&mosquitto_destroy)> client_{nullptr, mosquitto_destroy};
  boost::asio::steady_timer pause_;
  std::string reason_;  ///< of the end of the connection
  std::map<std::string, Last> last_;
  std::set<std::string> retained_;             ///< topics of statuses other than "gone", of earlier runs
  Clock::time_point retained_due_, last_ack_;  ///< last_ack_: or the first message without acknowledgement
  int in_flight_ = 0;                          ///< messages without acknowledgement
  bool up_ = false, stopping_ = false;
};

}  // namespace prism::prismrelay
