// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instance_client.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "config/socket_path.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono_literals::operator""ms;

// The first delay is long enough for systemd to report a stopped instance.
constexpr auto kFirstDelay = 1000ms, kLongestDelay = 10'000ms, kStoppedDelay = 2'000ms, kStatusTimeout = 10'000ms;

}  // namespace

InstanceClient::InstanceClient(boost::asio::io_context& context, RelayState& state, std::string gyro,
                               std::string socket, Callbacks callbacks)
    : context_(context),
      state_(state),
      gyro_(std::move(gyro)),
      socket_(std::move(socket)),
      callbacks_(std::move(callbacks)),
      timer_(context),
      retry_delay_(kFirstDelay) {}

void InstanceClient::start() { try_connect(); }

void InstanceClient::close() {
  closed_ = true;
  timer_.cancel();
  if (client_) client_->close();
  if (std::exchange(running_, false)) callbacks_.disconnected();
}

void InstanceClient::call(const char* method, const json& params, OnResponse on_response) {
  if (!client_ || !client_->is_open()) return;
  client_->call(method, params.is_null() ? "{}" : json_text(params),
                [method, on_response = std::move(on_response)](std::string_view member) {
                  on_response(client::response_of_member(method, member));
                });
}

void InstanceClient::try_connect() {
  if (closed_) return;
  if (config::would_start(socket_)) {
    state_.instance(gyro_, socket_, "stopped", "");
    return retry_after(kStoppedDelay);
  }
  client_ = std::make_shared<client::AsyncConnection>(context_);
  const std::weak_ptr<InstanceClient> weak = weak_from_this();
  client_->open(
      socket_,
      [weak](std::string_view line) {
        const auto self = weak.lock();
        if (!self || !self->running_) return;
        if (const auto notification = parse_json_line(line)) self->callbacks_.notification(*notification);
      },
      [weak](const std::string& reason) {
        if (const auto self = weak.lock()) self->on_disconnected(reason);
      });
  call("status", nullptr, [weak](const client::Response& status) {
    const auto self = weak.lock();
    if (!self || self->closed_) return;
    if (!status) return self->restart(status.error().error.what);
    self->timer_.cancel();
    self->retry_delay_ = kFirstDelay;
    self->running_ = true;
    self->state_.instance(self->gyro_, self->socket_, "running", "");
    self->callbacks_.connected(*status);
  });
  timer_.expires_after(kStatusTimeout);
  timer_.async_wait([weak](boost::system::error_code error) {
    if (const auto self = weak.lock(); self && !error && !self->running_) self->restart("does not respond");
  });
}

void InstanceClient::restart(const std::string& reason) {
  if (client_) client_->close();
  on_disconnected(reason);
}

void InstanceClient::on_disconnected(const std::string& reason) {
  if (closed_) return;
  if (std::exchange(running_, false)) callbacks_.disconnected();
  state_.instance(gyro_, socket_, config::would_start(socket_) ? "stopped" : "gone", reason);
  retry_after(retry_delay_);
  retry_delay_ = std::min(retry_delay_ * 2, std::chrono::milliseconds(kLongestDelay));
}

void InstanceClient::retry_after(std::chrono::milliseconds delay) {
  timer_.expires_after(scaled(delay));
  timer_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    if (const auto self = weak.lock(); self && !error) self->try_connect();
  });
}

StatusAxes axes_of(const json& status) {
  StatusAxes axes;
  for (const auto& [name, axis] : member(status, "axes").items()) {
    if (follows(TextRule::kAxisName, name)) {
      axes.names.push_back(name);
    } else {
      axes.invalid.push_back(shortened(name));
    }
  }
  return axes;
}

}  // namespace prism::prismrelay
