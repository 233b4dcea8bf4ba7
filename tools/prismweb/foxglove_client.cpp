// SPDX-License-Identifier: MIT
#include "tools/prismweb/foxglove_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/web_server.hpp"

namespace prism::prismweb {
namespace {

using nlohmann::json;

constexpr std::uint64_t kNoNumber = std::numeric_limits<std::uint64_t>::max();

/// Returns a 32-bit number, or kNoNumber.
std::uint64_t number32_of(const json& value) {
  const std::uint64_t number = value.is_number_unsigned() ? value.get<std::uint64_t>() : kNoNumber;
  return number <= std::numeric_limits<std::uint32_t>::max() ? number : kNoNumber;
}

std::uint64_t number32_of(const json& object, const char* key) {
  return object.is_object() ? number32_of(object.value(key, json())) : kNoNumber;
}

}  // namespace

FoxgloveClient::FoxgloveClient(WebServer& server, Channel& channel) : Client(server, channel) {}

void FoxgloveClient::begin() {
  add_to_server();
  send(foxglove_server_info("prism, " + server().host()));
  advertise();
}

void FoxgloveClient::send(const json& operation) {
  channel().answer(std::make_shared<const std::string>(json_text(operation)));
}

void FoxgloveClient::send_warning(const std::string& text) { send(foxglove_warning(text)); }

void FoxgloveClient::instances_changed(const Text&) { advertise(); }

// Sends new and removed channels. A number means the same topic while prismweb runs.
void FoxgloveClient::advertise() {
  json channels = json::array(), gone = json::array();
  const auto& all = server().foxglove_topics().all();
  for (const auto& [number, topic] : all) {
    if (advertised_.insert(number).second) channels.push_back(foxglove_channel(number, topic));
  }
  for (auto number = advertised_.begin(); number != advertised_.end();) {
    const bool there = all.contains(*number);
    if (!there) gone.push_back(*number);
    number = there ? std::next(number) : advertised_.erase(number);
  }
  // A subscription ends with its channel; Foxglove subscribes again when the channel returns.
  std::erase_if(subscriptions_, [&](const auto& known) { return !advertised_.contains(known.second.channel); });
  if (!gone.empty()) send({{"op", "unadvertise"}, {"channelIds", gone}});
  if (!channels.empty()) send({{"op", "advertise"}, {"channels", channels}});
}

std::optional<CloseReason> FoxgloveClient::message(std::string_view text, bool is_text) {
  const json request = is_text ? parse_message(text) : json();
  const json op = request.is_object() ? request.value("op", json()) : json();
  if (op == "subscribe") {
    subscribe(request);
  } else if (op == "unsubscribe") {
    unsubscribe(request);
  } else {
    send_warning(fmt::format("found {}, expected subscribe or unsubscribe: prismweb is read-only",
                             op.is_string() ? json_text(op).substr(0, 80) : "no operation"));
  }
  return std::nullopt;
}

void FoxgloveClient::subscribe(const json& request) {
  const auto& all = server().foxglove_topics().all();
  const json list = request.value("subscriptions", json());
  for (const json& one : list.is_array() ? list : json::array({nullptr})) {
    const std::uint64_t id = number32_of(one, "id"), channel = number32_of(one, "channelId");
    const auto topic = channel == kNoNumber ? all.end() : all.find(static_cast<std::uint32_t>(channel));
    const bool taken = std::any_of(subscriptions_.begin(), subscriptions_.end(),
                                   [&](const auto& known) { return id == known.second.id; });
    if (id == kNoNumber || topic == all.end() || taken || subscriptions_.contains(topic->second)) {
      send_warning(
          fmt::format("found {}, expected a new \"id\" and the \"channelId\" of a channel without a subscription",
                      json_text(one).substr(0, 80)));
    } else {
      subscriptions_.emplace(topic->second, ChannelSubscription{static_cast<std::uint32_t>(id), topic->first});
    }
  }
  subscribe();
}

void FoxgloveClient::unsubscribe(const json& request) {
  const json list = request.value("subscriptionIds", json());
  for (const json& one : list.is_array() ? list : json::array({nullptr})) {
    const std::uint64_t id = number32_of(one);
    if (std::erase_if(subscriptions_, [&](const auto& known) { return known.second.id == id; }) == 0)
      send_warning(fmt::format("found {}, expected the id of a subscription", json_text(one).substr(0, 80)));
  }
  subscribe();
}

void FoxgloveClient::subscribe() {
  for (const auto& proxy : server().instances().all()) {
    Subscription wanted;
    std::set<std::string> axes;
    for (const auto& [topic, subscription] : subscriptions_) {
      if (topic.instance != proxy->name()) continue;
      if (topic.stream == "sample") wanted.sample_every = 1;
      wanted.windows |= topic.stream == "window";
      wanted.events |= topic.stream == "event";
      if (!topic.axis.empty()) axes.insert(topic.axis);
    }
    wanted.axes.assign(axes.begin(), axes.end());
    proxy->subscribe(this, wanted);
  }
}

void FoxgloveClient::deliver(const std::string& instance, const Text& batch, std::uint64_t) {
  std::uint64_t lost = 0;
  for (const FoxgloveRow& row : foxglove_rows(*batch, lost)) {
    const auto subscription = subscriptions_.find(row.topic);
    if (subscription == subscriptions_.end()) continue;
    channel().batch(instance,
                    std::make_shared<const std::string>(foxglove_data(subscription->second.id, row.time_ns, row.json)),
                    1);
  }
  if (lost > 0) send_warning(fmt::format("{}: prismd dropped {} rows: prismweb was too slow", instance, lost));
}

std::string FoxgloveClient::lost_text(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) const {
  return json_text(foxglove_warning(
      fmt::format("{}: {} rows were dropped, {} in total: this client reads too slowly", instance, rows, rows_total)));
}

}  // namespace prism::prismweb
