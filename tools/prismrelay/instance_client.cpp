// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instance_client.hpp"

#include <algorithm>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "config/socket_path.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono_literals::operator""ms;

// The first pause gives systemd the time to say that somebody stopped it.
constexpr auto kFirstPause = 1000ms, kLongestPause = 10'000ms, kWhileStopped = 2'000ms, kAnswer = 10'000ms;

}  // namespace

InstanceClient::InstanceClient(boost::asio::io_context& context, RelayState& state, std::string gyro,
                               std::string socket, Calls calls)
    : context_(context),
      state_(state),
      gyro_(std::move(gyro)),
      socket_(std::move(socket)),
      calls_(std::move(calls)),
      timer_(context),
      pause_(kFirstPause) {}

void InstanceClient::begin() { try_connect(); }

void InstanceClient::close() {
  closed_ = true;
  timer_.cancel();
  if (client_) client_->close();
  if (std::exchange(running_, false)) calls_.gone();
}

void InstanceClient::ask(const char* method, const json& params, LineClient::Message answer) {
  if (client_ && client_->is_open()) client_->ask(method, params, std::move(answer));
}

void InstanceClient::try_connect() {
  if (closed_) return;
  if (config::would_start(socket_)) {
    state_.instance(gyro_, socket_, "stopped", "");
    return pause(kWhileStopped);
  }
  client_ = std::make_shared<LineClient>(context_);
  const std::weak_ptr<InstanceClient> weak = weak_from_this();
  client_->open(
      socket_,
      [weak](const json& told) {
        if (const auto self = weak.lock(); self && self->running_) self->calls_.told(told);
      },
      [weak](const std::string& why) {
        if (const auto self = weak.lock()) self->lost(why);
      });
  client_->ask("status", nullptr, [weak](const json& message) {
    const auto self = weak.lock();
    if (!self || self->closed_) return;
    const auto status = message.find("result");
    if (status == message.end() || !status->is_object()) return self->restart("does not answer status");
    self->timer_.cancel();
    self->pause_ = kFirstPause;
    self->running_ = true;
    self->state_.instance(self->gyro_, self->socket_, "running", "");
    self->calls_.begun(*status);
  });
  timer_.expires_after(kAnswer);
  timer_.async_wait([weak](boost::system::error_code error) {
    if (const auto self = weak.lock(); self && !error && !self->running_) self->restart("does not answer");
  });
}

void InstanceClient::restart(const std::string& why) {
  if (client_) client_->close();
  lost(why);
}

void InstanceClient::lost(const std::string& why) {
  if (closed_) return;
  if (std::exchange(running_, false)) calls_.gone();
  state_.instance(gyro_, socket_, config::would_start(socket_) ? "stopped" : "gone", why);
  pause(pause_);
  pause_ = std::min(pause_ * 2, std::chrono::milliseconds(kLongestPause));
}

void InstanceClient::pause(std::chrono::milliseconds time) {
  timer_.expires_after(time);
  timer_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    if (const auto self = weak.lock(); self && !error) self->try_connect();
  });
}

StatusAxes axes_of(const json& status) {
  StatusAxes axes;
  const auto add = [&](const std::string& name) {
    if (follows(TextRule::kAxisName, name)) return axes.names.push_back(name);
    axes.invalid.push_back(shortened(name));
  };
  const json& several = member(status, "axes");
  axes.several = several.is_object() && !several.empty();
  if (!axes.several) return add(text_member(status, "axis", "z")), axes;
  for (const auto& [name, own] : several.items()) add(name);
  return axes;
}

}  // namespace prism::prismrelay
