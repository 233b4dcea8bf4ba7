// SPDX-License-Identifier: MIT
#include "tools/prismrelay/mqtt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"

namespace prism::prismrelay {
namespace {

using std::chrono_literals::operator""ms;

constexpr const char* kBroker = "mqtt";
constexpr int kKeepAlive_s = 15, kAtLeastOnce = 1, kRound_ms = 1000;
constexpr std::chrono::milliseconds kFirstPause = 1000ms, kLongestPause = 5000ms;  // between attempts
constexpr std::chrono::seconds kLongestEnd{5};                                     // to send "offline"
constexpr const char* kStatusTopics = "+/+/status";

}  // namespace

bool is_topic_part(const std::string& name) {
  return follows(TextRule::kName, name) && name.find_first_of("+#") == std::string::npos && !name.starts_with('$');
}

Mqtt::Mqtt(const MqttSettings& settings, const std::string& site, RelayState& state)
    : settings_(settings), base_(settings.prefix + "/" + site + "/"), state_(state) {
  mosquitto_lib_init();
  last_["relay"] = {"online", true};
  thread_ = std::thread([this] { loop(); });
}

Mqtt::~Mqtt() {
  finish();
  client_.reset();
  mosquitto_lib_cleanup();
}

void Mqtt::loop() {
  auto delay = kFirstPause;
  while (!stopping_) {
    const auto begin = Clock::now();
    reason_.clear();
    const std::string reason = run_connection();
    {
      const std::lock_guard lock(mutex_);
      up_ = false;
      in_flight_ = 0;
    }
    if (stopping_) return;
    state_.down(kBroker, "mqtt: " + reason);
    if (Clock::now() - begin > scaled(kLongestPause)) delay = kFirstPause;
    for (auto left = scaled(delay); left > 0ms && !stopping_; left -= 100ms) std::this_thread::sleep_for(100ms);
    delay = std::min(delay * 2, kLongestPause);
  }
}

// Connects, and sends until the connection is lost or the program ends. Returns the reason of the loss. Each connection
// has a new client: libmosquitto would store unacknowledged messages of lost connections without limit.
std::string Mqtt::run_connection() {
  if (std::string error = prepare(); !error.empty()) return error;
  mosquitto* const client = client_.get();
  int code = mosquitto_connect_async(client, settings_.host.c_str(), settings_.port, kKeepAlive_s);
  Clock::time_point end = Clock::time_point::max();
  while (code == MOSQ_ERR_SUCCESS) {
    code = mosquitto_loop(client, kRound_ms, 1);
    const auto now = Clock::now();
    if (stopping_) end = std::min(end, now + kLongestEnd);
    const std::lock_guard lock(mutex_);
    if (stopping_ && (!up_ || now > end)) return "";
    if (code != MOSQ_ERR_SUCCESS) break;
    if (is_silent(now))
      return fmt::format("{}:{}: no acknowledgement for {} s", settings_.host, settings_.port, kAckTimeout.count());
    if (up_) send_unsent();
  }
  if (!reason_.empty()) return reason_;
  const char* const reason = code == MOSQ_ERR_ERRNO ? std::strerror(errno) : mosquitto_strerror(code);
  return fmt::format("{}:{}: {}", settings_.host, settings_.port, reason);
}

// Creates the client. Returns an error, e.g. of the password file, which may be temporary.
std::string Mqtt::prepare() {
  std::unique_ptr<mosquitto, Free> created(mosquitto_new(settings_.client_id.c_str(), true, this));
  mosquitto* const client = created.get();
  if (client == nullptr) return std::strerror(errno);
  if (!settings_.user.empty()) {
    std::string password;
    if (!settings_.password_file.empty()) {
      auto read = read_password(settings_.password_file);
      if (!read) return read.error().text();
      password = std::move(*read);
    }
    mosquitto_username_pw_set(client, settings_.user.c_str(), password.empty() ? nullptr : password.c_str());
  }
  if (settings_.tls) {
    const auto text = [](const std::string& path) { return path.empty() ? nullptr : path.c_str(); };
    const int code = mosquitto_tls_set(client, text(settings_.tls->ca), nullptr, text(settings_.tls->certificate),
                                       text(settings_.tls->key), nullptr);
    if (code != MOSQ_ERR_SUCCESS) return fmt::format("{}: {}", settings_.tls->ca, mosquitto_strerror(code));
  }
  const std::string will = "offline";
  mosquitto_will_set(client, (base_ + "relay").c_str(), static_cast<int>(will.size()), will.data(), kAtLeastOnce, true);
  mosquitto_threaded_set(client, true);
  mosquitto_max_inflight_messages_set(client, 100);
  set_callbacks(client);
  const std::lock_guard lock(
      mutex_);  // not before: libmosquitto has its own lock for the callbacks, which take this one
  client_.swap(created);
  last_ack_ = Clock::now();
  return "";
}

void Mqtt::set_callbacks(mosquitto* client) {
  mosquitto_connect_callback_set(client,
                                 [](mosquitto*, void* self, int code) { static_cast<Mqtt*>(self)->connected(code); });
  mosquitto_disconnect_callback_set(
      client, [](mosquitto*, void* self, int code) { static_cast<Mqtt*>(self)->disconnected(code); });
  mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int) { static_cast<Mqtt*>(self)->acknowledged(); });
  mosquitto_message_callback_set(client, [](mosquitto*, void* self, const mosquitto_message* message) {
    static_cast<Mqtt*>(self)->on_message(*message);
  });
  mosquitto_subscribe_callback_set(client, [](mosquitto*, void*, int, int count, const int* granted) {
    if (count > 0 && granted[0] > 2)
      log_line(Level::kWarning,
               "mqtt: the broker refused a subscription to the relay's own topics: it may retain the states of gyros "
               "that stopped before the relay started");
  });
}

void Mqtt::finish() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    if (up_) {
      send("relay", "offline", true);
      mosquitto_disconnect(client_.get());
    }
  }
  thread_.join();
}

void Mqtt::connected(int code) {
  if (code != 0) {
    reason_ = fmt::format("broker refused the connection: {}", mosquitto_connack_string(code));
    return;
  }
  const std::lock_guard lock(mutex_);
  up_ = true;
  in_flight_ = 0;
  retained_.clear();
  retained_taken_ = false;
  retained_due_ = Clock::now() + scaled(kRetainedWait);
  mosquitto_subscribe(client_.get(), nullptr, (base_ + kStatusTopics).c_str(), kAtLeastOnce);
  for (auto& [topic, last] : last_) last.sent = false;
  send_unsent();
}

void Mqtt::disconnected(int code) {
  const std::lock_guard lock(mutex_);
  up_ = false;
  if (code != 0 && reason_.empty()) reason_ = mosquitto_strerror(code);
}

void Mqtt::acknowledged() {
  {
    const std::lock_guard lock(mutex_);
    if (in_flight_ > 0) --in_flight_;
    last_ack_ = Clock::now();
  }
  state_.up(kBroker);
  state_.committed(kBroker);
}

// Requires mutex_. True if the broker has not acknowledged the connection or a message for kAckTimeout.
bool Mqtt::is_silent(Clock::time_point now) {
  return (!up_ || in_flight_ > 0) && now - last_ack_ > scaled(kAckTimeout);
}

// A retained GYRO/AXIS/status. Other messages, e.g. of the relay itself, are ignored.
void Mqtt::on_message(const mosquitto_message& message) {
  const std::string_view topic = message.topic;
  if (!message.retain || message.payloadlen <= 0 || !topic.starts_with(base_)) return;
  const std::string_view name = topic.substr(base_.size());
  const std::size_t first = name.find('/'), second = name.find('/', first + 1);
  if (first == std::string_view::npos || second == std::string_view::npos) return;
  GyroAndAxis axis{name.substr(0, first), name.substr(first + 1, second - first - 1)};
  if (!is_topic_part(axis.first) || !follows(TextRule::kAxisName, axis.second)) return;
  const auto status =
      parse_json_line({static_cast<const char*>(message.payload), static_cast<std::size_t>(message.payloadlen)});
  if (status && text_member(*status, "state") == "gone") return;
  const std::lock_guard lock(mutex_);
  if (retained_.size() < kMaxRetained) retained_.insert(std::move(axis));
}

std::set<Mqtt::GyroAndAxis> Mqtt::take_retained() {
  const std::lock_guard lock(mutex_);
  if (!up_ || retained_taken_ || Clock::now() < retained_due_) return {};
  retained_taken_ = true;
  mosquitto_unsubscribe(client_.get(), nullptr, (base_ + kStatusTopics).c_str());
  return std::exchange(retained_, {});
}

void Mqtt::publish_last(const std::string& topic, const std::string& text, bool retained) {
  const std::lock_guard lock(mutex_);
  Last& last = last_[topic];
  if (up_ && !last.sent && !last.text.empty()) state_.dropped(kBroker, 1);
  last = {text, retained, up_ && send(topic, text, retained)};
}

void Mqtt::publish_once(const std::string& topic, const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (!up_ || !send(topic, text, false)) state_.dropped(kBroker, 1);
}

// Requires mutex_. Publishes the last values that did not fit into the messages in flight.
void Mqtt::send_unsent() {
  for (auto& [topic, last] : last_) {
    if (!last.sent && !(last.sent = send(topic, last.text, last.retained))) return;
  }
}

// Requires mutex_.
bool Mqtt::send(const std::string& topic, const std::string& text, bool retained) {
  if (in_flight_ >= kMaxInFlight) return false;
  const int code = mosquitto_publish(client_.get(), nullptr, (base_ + topic).c_str(), static_cast<int>(text.size()),
                                     text.data(), kAtLeastOnce, retained);
  if (code != MOSQ_ERR_SUCCESS) return false;
  if (in_flight_++ == 0) last_ack_ = Clock::now();
  return true;
}

}  // namespace prism::prismrelay
