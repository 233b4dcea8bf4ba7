// SPDX-License-Identifier: MIT
#include "tools/prismrelay/mqtt.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "tools/client/client.hpp"

namespace prism::prismrelay {
namespace {

namespace asio = boost::asio;
using client::kUse;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

constexpr int kKeepAlive_s = 15, kAtLeastOnce = 1;
constexpr int kMaxInFlight = 1000;                                                 // messages without acknowledgement
constexpr std::size_t kMaxRetained = 10000;                                        // topics of earlier runs
constexpr std::chrono::milliseconds kFirstPause = 1000ms, kLongestPause = 5000ms;  // between attempts
constexpr auto kAckTimeout = 40s;
constexpr auto kRetainedWait = 5s;  // until the gyros that run are published
constexpr auto kLongestEnd = 5s;    // to send "offline"
constexpr const char* kStatusTopics = "+/+/status";

}  // namespace

bool is_topic_part(const std::string& name) {
  return follows(TextRule::kName, name) && name.find_first_of("+#") == std::string::npos && !name.starts_with('$');
}

std::string gone_text(const std::string& axis) {
  const nlohmann::json gone = {{"axis", axis}, {"state", "gone"}, {"quality", "no_data"}, {"since_s", host_time_s()}};
  return json_text(gone);
}

Mqtt::Mqtt(asio::io_context& io, const MqttSettings& settings, const std::string& site, Target& target)
    : io_(io), settings_(settings), base_(settings.prefix + "/" + site + "/"), target_(target), pause_(io) {
  mosquitto_lib_init();
  last_["relay"] = {"online", true};
}

asio::awaitable<void> Mqtt::run() {
  auto delay = kFirstPause;
  while (!stopping_) {
    const auto begin = Clock::now();
    reason_.clear();
    const std::string reason = co_await run_connection();
    up_ = false;
    in_flight_ = 0;
    if (stopping_) break;
    target_.down(fmt::format("mqtt: {}:{}: {}", settings_.host, settings_.port, reason));
    if (Clock::now() - begin > scaled(kLongestPause)) delay = kFirstPause;
    pause_.expires_after(scaled(delay));
    co_await pause_.async_wait(kUse);
    delay = std::min(delay * 2, kLongestPause);
  }
  io_.stop();
}

// Connects, and sends until the connection is lost or the program ends. Returns the reason of the loss. Each connection
// has a new client: libmosquitto would store unacknowledged messages of lost connections without limit.
asio::awaitable<std::string> Mqtt::run_connection() {
  using namespace asio::experimental::awaitable_operators;
  if (std::string failure = prepare(); !failure.empty()) co_return failure;
  // libmosquitto waits for the name server: it is called only after that had an answer.
  asio::ip::tcp::resolver resolver(io_);
  const auto [unknown, places] = co_await resolver.async_resolve(settings_.host, std::to_string(settings_.port), kUse);
  if (unknown) co_return unknown.message();
  mosquitto* const client = client_.get();
  int code = mosquitto_connect_async(client, settings_.host.c_str(), settings_.port, kKeepAlive_s);
  asio::posix::stream_descriptor socket(io_);
  boost::system::error_code error;
  if (code == MOSQ_ERR_SUCCESS) socket.assign(::dup(mosquitto_socket(client)), error);
  if (error) co_return error.message();
  Clock::time_point end = Clock::time_point::max();
  while (code == MOSQ_ERR_SUCCESS) {
    pause_.expires_after(up_ && !stopping_ && !mosquitto_want_write(client) ? 1000ms : 50ms);
    const auto woken = co_await (socket.async_wait(socket.wait_read, kUse) || pause_.async_wait(kUse));
    (void)woken;
    code = mosquitto_loop_read(client, 1);
    if (code == MOSQ_ERR_SUCCESS && mosquitto_want_write(client)) code = mosquitto_loop_write(client, 1);
    if (code == MOSQ_ERR_SUCCESS) code = mosquitto_loop_misc(client);
    const auto now = Clock::now();
    if (stopping_) end = std::min(end, now + kLongestEnd);
    if (stopping_ && (!up_ || now > end)) co_return "";
    if (code != MOSQ_ERR_SUCCESS) break;
    if ((!up_ || in_flight_ > 0) && now - last_ack_ > scaled(kAckTimeout))
      co_return fmt::format("no acknowledgement for {} s", kAckTimeout.count());
    if (up_ && now > retained_due_) replace_retained();
    if (up_) send_unsent();
  }
  if (!reason_.empty()) co_return reason_;
  co_return code == MOSQ_ERR_ERRNO ? std::strerror(errno) : mosquitto_strerror(code);
}

// Creates the client. Returns an error, e.g. of the password file, which may be temporary.
std::string Mqtt::prepare() {
  client_.reset(mosquitto_new(settings_.client_id.c_str(), true, this));
  mosquitto* const client = client_.get();
  if (client == nullptr) return std::strerror(errno);
  if (!settings_.user.empty()) {
    const auto password =
        settings_.password_file.empty() ? Result<std::string>() : read_password(settings_.password_file);
    if (!password) return password.error().text();
    mosquitto_username_pw_set(client, settings_.user.c_str(), password->empty() ? nullptr : password->c_str());
  }
  if (settings_.tls) {
    const auto text = [](const std::string& path) { return path.empty() ? nullptr : path.c_str(); };
    const int code = mosquitto_tls_set(client, text(settings_.tls->ca), nullptr, text(settings_.tls->certificate),
                                       text(settings_.tls->key), nullptr);
    if (code != MOSQ_ERR_SUCCESS) return fmt::format("{}: {}", settings_.tls->ca, mosquitto_strerror(code));
  }
  const std::string will = "offline";
  mosquitto_will_set(client, (base_ + "relay").c_str(), static_cast<int>(will.size()), will.data(), kAtLeastOnce, true);
  mosquitto_max_inflight_messages_set(client, 100);
  set_callbacks();
  last_ack_ = Clock::now();
  return "";
}

void Mqtt::set_callbacks() {
  mosquitto* const client = client_.get();
  mosquitto_connect_callback_set(client, [](mosquitto*, void* self, int code) {
    auto& mqtt = *static_cast<Mqtt*>(self);
    if (code == 0) return mqtt.connected();
    mqtt.reason_ = fmt::format("broker refused the connection: {}", mosquitto_connack_string(code));
  });
  mosquitto_disconnect_callback_set(client, [](mosquitto*, void* self, int code) {
    auto& mqtt = *static_cast<Mqtt*>(self);
    mqtt.up_ = false;
    if (code != 0 && mqtt.reason_.empty()) mqtt.reason_ = mosquitto_strerror(code);
  });
  mosquitto_publish_callback_set(client, [](mosquitto*, void* self, int) {
    auto& mqtt = *static_cast<Mqtt*>(self);
    if (mqtt.in_flight_ > 0) --mqtt.in_flight_;
    mqtt.last_ack_ = Clock::now();
    mqtt.target_.up();
    mqtt.target_.last_s = host_time_s();
  });
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

void Mqtt::connected() {
  up_ = true;
  in_flight_ = 0;
  retained_.clear();
  retained_due_ = Clock::now() + scaled(kRetainedWait);
  mosquitto_subscribe(client_.get(), nullptr, (base_ + kStatusTopics).c_str(), kAtLeastOnce);
  for (auto& [topic, last] : last_) last.sent = false;
  send_unsent();
}

// A retained GYRO/AXIS/status. Other messages, e.g. of the relay itself, are ignored.
void Mqtt::on_message(const mosquitto_message& message) {
  const std::string_view topic = message.topic;
  if (!message.retain || message.payloadlen <= 0 || !topic.starts_with(base_)) return;
  const auto status =
      parse_json_line({static_cast<const char*>(message.payload), static_cast<std::size_t>(message.payloadlen)});
  if (status && text_member(*status, "state") == "gone") return;
  if (retained_.size() < kMaxRetained) retained_.emplace(topic.substr(base_.size()));
}

// A broker that kept its memory may retain states from before the start of the relay.
void Mqtt::replace_retained() {
  retained_due_ = Clock::time_point::max();
  mosquitto_unsubscribe(client_.get(), nullptr, (base_ + kStatusTopics).c_str());
  for (const std::string& topic : std::exchange(retained_, {})) {
    const std::size_t first = topic.find('/'), second = topic.find('/', first + 1);
    const std::string gyro = topic.substr(0, first), axis = topic.substr(first + 1, second - first - 1);
    if (!last_.contains(topic) && is_topic_part(gyro) && follows(TextRule::kAxisName, axis))
      publish_last(topic, gone_text(axis), true);
  }
}

void Mqtt::publish_last(const std::string& topic, const std::string& text, bool retained) {
  Last& last = last_[topic];
  if (up_ && !last.sent && !last.text.empty()) ++target_.dropped;
  last = {text, retained, up_ && send(topic, text, retained)};
}

void Mqtt::publish_once(const std::string& topic, const std::string& text) {
  if (!up_ || !send(topic, text, false)) ++target_.dropped;
}

void Mqtt::finish() {
  if (up_) {
    send("relay", "offline", true);
    mosquitto_disconnect(client_.get());
  }
  stopping_ = true;
  pause_.cancel();
}

// Publishes the last values that did not fit into the messages in flight.
void Mqtt::send_unsent() {
  for (auto& [topic, last] : last_) {
    if (!last.sent && !(last.sent = send(topic, last.text, last.retained))) return;
  }
}

bool Mqtt::send(const std::string& topic, const std::string& text, bool retained) {
  if (in_flight_ >= kMaxInFlight) return false;
  const int code = mosquitto_publish(client_.get(), nullptr, (base_ + topic).c_str(), static_cast<int>(text.size()),
                                     text.data(), kAtLeastOnce, retained);
  if (code != MOSQ_ERR_SUCCESS) return false;
  if (in_flight_++ == 0) last_ack_ = Clock::now();
  return true;
}

}  // namespace prism::prismrelay
