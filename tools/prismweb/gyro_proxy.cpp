// SPDX-License-Identifier: MIT
#include "tools/prismweb/gyro_proxy.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cctype>
#include <chrono>
#include <numeric>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "config/socket_protocol.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using client::error_member;
using client::kUse;
using nlohmann::json;

constexpr std::size_t kMaxInstances = 256;
constexpr std::chrono::seconds kFindInterval{2};
// Messages of an instance; docs/protocol.md guarantees at most 25.
constexpr std::size_t kFlushesPerSecond = 20;
// prismd responds without the id to a request of more than 2000 values, and closes the connection, which all clients
// share, if a line is longer than 65 536 bytes. Params of at most 2000 bytes exceed neither.
constexpr std::size_t kMaxParamsBytes = 2000;
// More than any device has. Each row is compared with a client's list, so its length is limited.
constexpr std::size_t kMaxAxes = 64;

// Returns the text between `head` and the next quotation mark; empty if `text` does not begin with `head`.
std::string_view quoted_after(std::string_view text, std::string_view head) {
  if (!text.starts_with(head)) return {};
  const std::size_t end = text.find('"', head.size());
  return end == std::string_view::npos ? std::string_view() : text.substr(head.size(), end - head.size());
}

asio::awaitable<std::string> wait_until_end(asio::io_context& io) {
  asio::steady_timer forever(io, asio::steady_timer::time_point::max());
  co_await forever.async_wait(kUse);
  co_return "";
}

}  // namespace

Result<Subscription> subscription_of(const json& params, bool on, Subscription before) {
  const auto wrong = [&] {
    return make_error("", "found " + json_text(params).substr(0, 80) +
                              R"(, expected {"streams": ["sample", "window", "event"], "every": 1 to 1000000, )"
                              R"("axes": [NAME, …]})");
  };
  json streams = {"sample", "window", "event"}, axes = json::array(), every = 1;
  if (!params.is_null() && !params.is_object()) return wrong();
  for (const auto& [key, value] : params.items()) {
    json* const known = key == "streams" ? &streams : key == "axes" ? &axes : key == "every" ? &every : nullptr;
    if (known == nullptr || (known != &every && (!value.is_array() || value.empty() || value.size() > kMaxAxes)))
      return wrong();
    *known = value;
  }
  if (!every.is_number_integer() || every < 1 || every > 1'000'000) return wrong();
  before.axes.clear();
  for (const json& axis : axes) {
    if (!axis.is_string()) return wrong();
    before.axes.push_back(axis);
  }
  std::sort(before.axes.begin(), before.axes.end());
  for (const json& stream : streams) {
    if (stream == "sample") {
      before.sample_every = on ? every.get<std::uint32_t>() : 0;
    } else if (stream == "window" || stream == "event") {
      (stream == "window" ? before.windows : before.events) = on;
    } else {
      return wrong();
    }
  }
  return before;
}

Notification notification_of(std::string_view line) {
  constexpr std::string_view kHead = R"({"jsonrpc":"2.0","method":")";
  const std::string_view method = quoted_after(line, kHead);
  if (method.empty()) return {};
  return {method, quoted_after(line.substr(kHead.size() + method.size()), R"(","params":{"axis":")"), line};
}

void Batch::put(const Notification& notification, std::uint32_t every) {
  const auto& [sample_every, windows, events, axes] = subscription;
  const std::string_view method = notification.method;
  const bool is_named =
      notification.axis.empty() || axes.empty() || std::find(axes.begin(), axes.end(), notification.axis) != axes.end();
  if ((method == "event" && !events) || (method == "window" && !(windows && is_named))) return;
  if (method == "sample") {
    if (sample_every == 0 || !is_named) return;
    auto skipped_here = skipped.find(notification.axis);
    if (skipped_here == skipped.end()) skipped_here = skipped.emplace(notification.axis, 0).first;
    skipped_here->second += every;
    if (skipped_here->second < sample_every) return;
    skipped_here->second = 0;
  }  // "lost" concerns all subscribers
  if (!lines.empty()) lines += ',';
  lines += notification.line;
  ++rows;
}

GyroProxy::GyroProxy(GyroProxies& all, const client::InstanceSocket& instance)
    : all_(all),
      short_(all.io_, instance.path),
      long_(all.io_, instance.path),
      resubscribe_(all.io_, asio::steady_timer::time_point::max()) {
  short_.on_notification = [this](std::string_view line) { take_notification(line); };
  short_.on_end = [this](client::State state, const std::string&) {
    if (std::exchange(state_, state) != state) all_.announce();
  };
  const client::Client::Session session_of_short = [this] { return session(); };
  const client::Client::Session session_of_long = [&io = all.io_] { return wait_until_end(io); };
  asio::co_spawn(all.io_, short_.run(session_of_short), asio::detached);
  asio::co_spawn(all.io_, long_.run(session_of_long), asio::detached);
}

json GyroProxy::listing() const {
  const char* const state = is_running() ? "running" : state_ == client::State::kStopped ? "stopped" : "gone";
  return {{"name", name()}, {"state", state}, {"axes", axes_}};
}

// Subscribes before the histories are loaded, so that no second is missed.
asio::awaitable<std::string> GyroProxy::session() {
  const client::Response status = co_await short_.ask("status");
  const std::string problem = !status && status.error().code == config::kFailed ? status.error().text() : "";
  if (std::exchange(problem_, problem) != problem && !problem.empty())  // once, not at each reconnect
    fmt::print(stderr, "prismweb: {}: {}\n", name(), problem);
  if (!status) co_return status.error().text();
  const std::string subscribed = co_await short_.ask_text("subscribe", R"({"streams":["window","event"]})");
  if (!subscribed.starts_with(R"("result")")) co_return "no subscription";
  take_axes(*status);
  for (every_ = 0;;) {
    const std::uint32_t every = sample_every();
    if (every == every_) {
      co_await resubscribe_.async_wait(kUse);
    } else {
      every_ = every;
      const std::string params =
          every > 0 ? fmt::format(R"({{"streams":["sample"],"every":{}}})", every) : R"({"streams":["sample"]})";
      co_await short_.ask_text(every > 0 ? "subscribe" : "unsubscribe", params);
    }
  }
}

void GyroProxy::take_axes(const json& status) {
  axes_.clear();
  for (const auto& [axis, own] : member(status, "axes").items()) {
    axes_.push_back(axis);
    auto& history = histories_[axis];
    if (!history) {
      const std::string& state = all_.state_;
      const std::string folder = state.empty() ? "" : state + "/" + path_part(name()) + "/" + path_part(axis);
      history = std::make_shared<History>(all_.io_, all_.disk_, long_, axis, folder);
      asio::co_spawn(all_.io_, history->follow(), asio::detached);
    }
    asio::co_spawn(all_.io_, history->load(), asio::detached);
  }
  state_ = client::State::kConnected;
  all_.announce();
}

void GyroProxy::take_notification(std::string_view line) {
  const Notification notification = notification_of(line);
  if (notification.method.empty()) return;
  const auto history = histories_.find(notification.axis);
  if (notification.method == "window" && history != histories_.end())
    history->second->window(member(json::parse(line, nullptr, false), "params"));
  const std::uint32_t every = std::max(every_, 1U);
  for (auto& [subscriber, batch] : batches_) batch.put(notification, every);
}

std::uint32_t GyroProxy::sample_every() const {
  const auto join = [](std::uint32_t all, const auto& one) {
    return std::gcd(all, one.second.subscription.sample_every);
  };
  return std::accumulate(batches_.begin(), batches_.end(), std::uint32_t{0}, join);
}

asio::awaitable<std::string> GyroProxy::call(std::string method, json params) {
  if (!is_running()) co_return error_member(config::kGone, name() + " is not running");
  if (!params.is_null() && !params.is_object())
    co_return error_member(config::kInvalidParams, "params: expected an object");
  std::string text = params.is_null() ? "{}" : json_text(params);
  if (text.size() > kMaxParamsBytes)
    co_return error_member(config::kInvalidParams,
                           fmt::format("found params of {} bytes, expected at most {}", text.size(), kMaxParamsBytes));
  const config::SocketMethod* const known = config::find_method(method);
  client::Client& connection = known != nullptr && known->is_long ? long_ : short_;
  co_return co_await connection.ask_text(std::move(method), std::move(text));
}

void GyroProxy::subscribe(Subscriber* subscriber, const Subscription& subscription) {
  const auto found = batches_.find(subscriber);
  const bool is_empty = subscription.sample_every == 0 && !subscription.windows && !subscription.events;
  if (is_empty && found != batches_.end()) batches_.erase(found);
  if (!is_empty) batches_[subscriber].subscription = subscription;
  resubscribe_.cancel();
}

Subscription GyroProxy::subscription_of(Subscriber* subscriber) const {
  const auto found = batches_.find(subscriber);
  return found == batches_.end() ? Subscription() : found->second.subscription;
}

std::shared_ptr<History> GyroProxy::history(const json& params) const {
  const json& axis = member(params, "axis");
  if (axis.is_null() && histories_.size() == 1) return histories_.begin()->second;
  const auto found = axis.is_string() ? histories_.find(axis.get_ref<const std::string&>()) : histories_.end();
  return found == histories_.end() ? nullptr : found->second;
}

std::string GyroProxy::wrong_axis() const {
  if (histories_.empty()) return error_member(config::kGone, name() + " has not been connected yet");
  return error_member(config::kInvalidParams, fmt::format("expected \"axis\", one of {}", fmt::join(axes_, ", ")));
}

bool GyroProxy::flush() {
  const std::string head = R"({"instance":)" + json_text(json(name())) + R"(,"batch":[)";
  bool has_rows = false;
  for (auto& [subscriber, batch] : batches_) {
    if (batch.rows == 0) continue;
    has_rows = true;
    const auto text = std::make_shared<const std::string>(head + batch.lines + "]}");
    batch.lines.clear();
    subscriber->deliver(name(), text, std::exchange(batch.rows, 0));
  }
  return has_rows;
}

GyroProxies::GyroProxies(asio::io_context& io, DiskThread& disk, std::vector<std::string> wanted, std::string state)
    : io_(io), disk_(disk), wanted_(std::move(wanted)), state_(std::move(state)) {
  asio::co_spawn(io_, find_instances(), asio::detached);
  asio::co_spawn(io_, flush_in_turn(), asio::detached);
}

GyroProxy* GyroProxies::find(std::string_view name) const {
  const auto found =
      std::find_if(proxies_.begin(), proxies_.end(), [&](const auto& one) { return one->name() == name; });
  return found == proxies_.end() ? nullptr : found->get();
}

json GyroProxies::listing() const {
  json list = json::array();
  for (const auto& proxy : proxies_) list.push_back(proxy->listing());
  return list;
}

void GyroProxies::remove(Subscriber* subscriber) {
  subscribers_.erase(subscriber);
  for (const auto& proxy : proxies_) proxy->subscribe(subscriber, {});
}

void GyroProxies::announce() const {
  const json list = {{"jsonrpc", "2.0"}, {"method", "instances"}, {"params", listing()}};
  const auto text = std::make_shared<const std::string>(json_text(list));
  for (Subscriber* const subscriber : subscribers_) subscriber->announce(text);
}

// Other programs may create files in a directory of sockets. An invalid name could corrupt /metrics of all instances.
asio::awaitable<void> GyroProxies::find_instances() {
  asio::steady_timer pause(io_);
  for (std::set<std::string> ignored;;) {
    std::vector<std::string> invalid;
    for (const client::InstanceSocket& instance : client::list_instances(wanted_, &invalid)) {
      if (find(instance.name) != nullptr || proxies_.size() >= kMaxInstances) continue;
      proxies_.push_back(std::make_unique<GyroProxy>(*this, instance));
      announce();
    }
    for (const std::string& socket : invalid) {
      if (ignored.size() >= kMaxInstances || !ignored.insert(socket).second) continue;
      const Error error{socket, std::string("invalid name, expected ") + rule_text(TextRule::kName)};
      fmt::print(stderr, "prismweb: ignored: {}\n", error.text());
    }
    pause.expires_after(scaled(kFindInterval));
    co_await pause.async_wait(kUse);
  }
}

// One instance per interval, so that a client of several instances does not get more messages per second. With more
// than 20 instances, each has its turn every second.
asio::awaitable<void> GyroProxies::flush_in_turn() {
  asio::steady_timer tick(io_);
  for (std::size_t next = 0;;) {
    tick.expires_after(std::chrono::milliseconds(1000 / kFlushesPerSecond));
    co_await tick.async_wait(kUse);
    std::size_t due = (proxies_.size() + kFlushesPerSecond - 1) / kFlushesPerSecond;
    for (std::size_t i = 0; i < proxies_.size() && due > 0; ++i) {
      if (proxies_[next++ % proxies_.size()]->flush()) --due;
    }
  }
}

std::string path_part(const std::string& name) {
  std::string part;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) || c == '_' || c == '-' || (c == '.' && !part.empty());
    part += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return part;
}

}  // namespace prism::prismweb
