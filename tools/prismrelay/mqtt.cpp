// SPDX-License-Identifier: MIT
#include "tools/prismrelay/mqtt.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "base/outside_text.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kBroker = "mqtt";
constexpr int kKeepAlive_s = 15, kAtLeastOnce = 1, kRound_ms = 1000;
constexpr int kLongestDelay_s = 5;  // between attempts

}  // namespace

bool is_topic_part(const std::string& name) {
  return follows(TextRule::kName, name) && name.find_first_of("+#") == std::string::npos && !name.starts_with('$');
}

Mqtt::Mqtt(const MqttSettings& settings, const std::string& site, RelayState& state)
    : settings_(settings), base_(settings.prefix + "/" + site + "/"), state_(state) {
  mosquitto_lib_init();
  client_.reset(mosquitto_new(settings.client_id.c_str(), true, this));
  last_["relay"] = {"online", true};
  retry();
}

// Reports local errors, e.g. of the password file, in the same way as errors of the broker.
void Mqtt::retry() {
  if (started_ || !client_) return;
  mosquitto* const client = client_.get();
  const auto failed = [&](int code, const std::string& what) {
    if (code == MOSQ_ERR_SUCCESS) return false;
    state_.down(kBroker, fmt::format("mqtt: {}: {}", what, mosquitto_strerror(code)));
    return true;
  };
  if (!settings_.user.empty()) {
    std::string password;
    if (!settings_.password_file.empty()) {
      auto read = read_password(settings_.password_file);
      if (!read) return state_.down(kBroker, "mqtt: " + read.error().text());
      password = std::move(*read);
    }
    mosquitto_username_pw_set(client, settings_.user.c_str(), password.empty() ? nullptr : password.c_str());
  }
  if (settings_.tls) {
    const auto text = [](const std::string& path) { return path.empty() ? nullptr : path.c_str(); };
    if (failed(mosquitto_tls_set(client, text(settings_.ca_file), nullptr, text(settings_.cert_file),
                                 text(settings_.key_file), nullptr),
               settings_.ca_file))
      return;
  }
  const std::string will = "offline";
  mosquitto_will_set(client, (base_ + "relay").c_str(), static_cast<int>(will.size()), will.data(), kAtLeastOnce, true);
  mosquitto_threaded_set(client, true);
  mosquitto_reconnect_delay_set(client, 1, kLongestDelay_s, true);
  mosquitto_max_inflight_messages_set(client, 100);
  mosquitto_connect_callback_set(client,
                                 [](mosquitto*, void* self, int code) { static_cast<Mqtt*>(self)->connected(code); });
  mosquitto_disconnect_callback_set(
      client, [](mosquitto*, void* self, int code) { static_cast<Mqtt*>(self)->disconnected(code); });
  mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int) {
    auto& mqtt = *static_cast<Mqtt*>(self);
    {
      const std::lock_guard lock(mqtt.mutex_);
      if (mqtt.in_flight_ > 0) --mqtt.in_flight_;  // 0: sent before a reconnection, which reset the counter
    }
    mqtt.state_.committed(kBroker);
  });
  started_ = true;
  thread_ = std::thread([this] { loop(); });
}

// Runs on our thread: the thread of libmosquitto ends if a name is not found or TLS fails, which may be temporary.
void Mqtt::loop() {
  mosquitto* const client = client_.get();
  int code = mosquitto_connect_async(client, settings_.host.c_str(), settings_.port, kKeepAlive_s);
  while (!stopping_) {
    if (code == MOSQ_ERR_SUCCESS) code = mosquitto_loop_forever(client, kRound_ms, 1);
    if (stopping_ || code == MOSQ_ERR_SUCCESS) break;
    const char* const reason = code == MOSQ_ERR_ERRNO ? std::strerror(errno) : mosquitto_strerror(code);
    state_.down(kBroker, fmt::format("mqtt: {}:{}: {}", settings_.host, settings_.port, reason));
    for (int i = 0; i < kLongestDelay_s && !stopping_; ++i) std::this_thread::sleep_for(std::chrono::seconds(1));
    code = mosquitto_reconnect(client);
  }
}

Mqtt::~Mqtt() {
  finish();
  client_.reset();
  mosquitto_lib_cleanup();
}

void Mqtt::finish() {
  if (!std::exchange(started_, false)) return;
  {
    const std::lock_guard lock(mutex_);
    if (up_) send("relay", "offline", true);
  }
  stopping_ = true;
  mosquitto_disconnect(client_.get());
  thread_.join();
}

void Mqtt::connected(int code) {
  if (code != 0)
    return state_.down(kBroker, fmt::format("mqtt: broker refused the connection: {}", mosquitto_connack_string(code)));
  state_.up(kBroker);
  const std::lock_guard lock(mutex_);
  up_ = true;
  in_flight_ = 0;
  for (const auto& [topic, last] : last_) send(topic, last.text, last.retained);
}

void Mqtt::disconnected(int code) {
  {
    const std::lock_guard lock(mutex_);
    up_ = false;
  }
  if (code != 0) state_.down(kBroker, fmt::format("mqtt: {}", mosquitto_strerror(code)));
}

void Mqtt::publish_last(const std::string& topic, const std::string& text, bool retained) {
  const std::lock_guard lock(mutex_);
  last_[topic] = {text, retained};
  if (up_ && !send(topic, text, retained)) state_.dropped(kBroker, 1);
}

void Mqtt::publish_once(const std::string& topic, const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (!up_ || !send(topic, text, false)) state_.dropped(kBroker, 1);
}

// Requires mutex_.
bool Mqtt::send(const std::string& topic, const std::string& text, bool retained) {
  if (in_flight_ >= kMaxInFlight) return false;
  const int code = mosquitto_publish(client_.get(), nullptr, (base_ + topic).c_str(), static_cast<int>(text.size()),
                                     text.data(), kAtLeastOnce, retained);
  if (code == MOSQ_ERR_SUCCESS) ++in_flight_;
  return code == MOSQ_ERR_SUCCESS;
}

}  // namespace prism::prismrelay
