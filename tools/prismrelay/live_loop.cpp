// SPDX-License-Identifier: MIT
#include "tools/prismrelay/live_loop.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "tools/prismrelay/instances.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono_literals::operator""s;

constexpr unsigned kStatusEvery_s = 5;

}  // namespace

LiveLoop::LiveLoop(const Settings& settings, RelayState& state)
    : settings_(settings), state_(state), context_(1), second_timer_(context_) {
  if (settings.mqtt) mqtt_ = std::make_unique<Mqtt>(*settings.mqtt, settings.site, state);
}

void LiveLoop::run() {
  once_a_second();
  context_.run();
}

void LiveLoop::stop() {
  boost::asio::post(context_, [this] {
    for (auto& [gyro, source] : sources_) source.instance->close();
    if (mqtt_) mqtt_->finish();
    context_.stop();
  });
}

void LiveLoop::follow(const std::string& gyro, const std::string& name, const std::string& socket) {
  if (mqtt_ && !is_topic_part(name) && unpublished_.insert(name).second)
    log_line(Level::kWarning,
             fmt::format(
                 "mqtt: the gyro \"{}\" is not published: its name contains +, # or a leading $, which MQTT reserves "
                 "in topics",
                 name));
  Source& source = sources_[gyro];
  InstanceClient::Callbacks callbacks;
  callbacks.connected = [this, &source, gyro, name](const json& status) {
    source.status_pending = false;
    on_status(gyro, name, status);
    source.instance->call("subscribe", {{"streams", {"window", "event"}}}, [](const client::Response&) {});
  };
  callbacks.notification = [this, &source, name](const json& message) { on_notification(name, source.axes, message); };
  callbacks.disconnected = [this, &source, name] { publish_offline(name, source.axes, "gone"); };
  source.instance = std::make_shared<InstanceClient>(context_, state_, gyro, socket, std::move(callbacks));
  source.instance->start();
}

void LiveLoop::on_notification(const std::string& name, const std::set<std::string>& axes, const json& notification) {
  if (!mqtt_ || unpublished_.count(name) != 0) return;
  const std::string method = text_member(notification, "method");
  const json& params = member(notification, "params");
  const std::string axis = text_member(params, "axis");
  if (method == "window" && axes.count(axis) != 0)
    mqtt_->publish_last(name + "/" + axis + "/window", json_text(params), false);
  if (method == "event") mqtt_->publish_once(name + "/event", json_text(params));
  if (method == "lost") state_.dropped("mqtt", count_member(params, "rows"));
}

void LiveLoop::on_status(const std::string& gyro, const std::string& name, json status) {
  Source& source = sources_[gyro];
  const StatusAxes axes = axes_of(status);
  source.axes = {axes.names.begin(), axes.names.end()};
  for (const std::string& axis : axes.invalid) state_.log_skipped_axis(gyro, axis);
  if (mqtt_ && unpublished_.count(name) == 0) {
    for (const std::string& axis : source.axes) {
      json axis_status = client::with_axis(status, axis);
      axis_status["state"] = "running";
      mqtt_->publish_last(fmt::format("{}/{}/status", name, axis), json_text(axis_status), true);
    }
  }
  state_.status(gyro, std::move(status));
}

// Replaces the retained status, which is no longer true. A broker keeps it until the next message.
void LiveLoop::publish_offline(const std::string& name, const std::set<std::string>& axes, const std::string& state) {
  if (!mqtt_ || unpublished_.count(name) != 0) return;
  for (const std::string& axis : axes) {
    const json offline = {{"axis", axis}, {"state", state}, {"quality", "no_data"}, {"since_s", host_time_s()}};
    mqtt_->publish_last(fmt::format("{}/{}/status", name, axis), json_text(offline), true);
    mqtt_->publish_last(fmt::format("{}/{}/window", name, axis), json_text(offline), false);
  }
}

// A broker that kept its memory may retain states from before the start of the relay. Those of gyros and axes that do
// not run now become "gone"; the others were published already.
void LiveLoop::replace_retained() {
  for (const auto& [name, axis] : mqtt_->take_retained()) {
    const auto source = sources_.find(settings_.site + "/" + name);
    const bool runs =
        source != sources_.end() && source->second.instance->running() && source->second.axes.count(axis) != 0;
    if (!runs) publish_offline(name, {axis}, "gone");
  }
}

void LiveLoop::once_a_second() {
  state_.progress(kLoop);
  update_sources(
      sources_, settings_, state_,
      [this](const auto& gyro, const auto& name, const auto& socket) { follow(gyro, name, socket); },
      [](const Source&) {});
  if (mqtt_) replace_retained();
  for (auto& [gyro, source] : sources_) {
    if (second_ % kStatusEvery_s != 0 || !source.instance->running()) continue;
    if (std::exchange(source.status_pending, true)) {
      source.instance->restart("does not respond");
      source.status_pending = false;
      continue;
    }
    const std::string name = gyro.substr(settings_.site.size() + 1);
    source.instance->call("status", nullptr, [this, gyro = gyro, name](const client::Response& status) {
      const auto found = sources_.find(gyro);
      if (found == sources_.end()) return;
      found->second.status_pending = false;
      if (status) on_status(gyro, name, *status);
    });
  }
  ++second_;
  second_timer_.expires_after(scaled(1s));
  second_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) once_a_second();
  });
}

}  // namespace prism::prismrelay
