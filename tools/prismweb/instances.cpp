// SPDX-License-Identifier: MIT
#include "tools/prismweb/instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/outside_text.hpp"
#include "base/time_scale.hpp"
#include "tools/prismweb/awaiting.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kMaxInstances = 256;
constexpr std::chrono::seconds kFindInterval{2};
constexpr std::chrono::milliseconds kFlushInterval{
    50};  // 20 messages per second; docs/protocol.md guarantees at most 25

}  // namespace

Instances::Instances(asio::io_context& io, std::vector<std::string> wanted) : io_(io), wanted_(std::move(wanted)) {}

void Instances::start() {
  asio::co_spawn(io_, find_instances(), asio::detached);
  asio::co_spawn(io_, flush_in_turn(), asio::detached);
}

InstanceProxy* Instances::find(const std::string& name) {
  const auto found =
      std::find_if(proxies_.begin(), proxies_.end(), [&](const auto& proxy) { return proxy->name() == name; });
  return found == proxies_.end() ? nullptr : found->get();
}

nlohmann::json Instances::listing() const {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& proxy : proxies_) list.push_back(proxy->listing());
  return list;
}

// Other programs may create files in a directory of sockets. An invalid name could corrupt /metrics of all instances.
void Instances::ignore(const std::string& socket) {
  if (ignored_.size() >= kMaxInstances || !ignored_.insert(socket).second) return;
  const Error error{socket, std::string("invalid name, expected ") + rule_text(TextRule::kName)};
  fmt::print(stderr, "prismweb: ignored: {}\n", error.text());
}

void Instances::add(const client::InstanceSocket& instance) {
  if (find(instance.name) != nullptr || proxies_.size() >= kMaxInstances) return;
  proxies_.push_back(std::make_unique<InstanceProxy>(io_, instance.name, instance.path));
  InstanceProxy& proxy = *proxies_.back();
  proxy.on_change = [this] {
    if (on_change) on_change();
  };
  if (on_new) on_new(proxy);
  asio::co_spawn(io_, proxy.run(), asio::detached);
  if (on_change) on_change();
}

asio::awaitable<void> Instances::find_instances() {
  asio::steady_timer pause(io_);
  for (;;) {
    std::vector<std::string> invalid;
    for (const client::InstanceSocket& instance : client::list_instances(wanted_, &invalid)) add(instance);
    for (const std::string& socket : invalid) ignore(socket);
    pause.expires_after(scaled(kFindInterval));
    co_await pause.async_wait(kUse);
  }
}

asio::awaitable<void> Instances::flush_in_turn() {
  asio::steady_timer tick(io_);
  for (;;) {
    tick.expires_after(kFlushInterval);
    co_await tick.async_wait(kUse);
    flush_next();
  }
}

// One instance per interval, so that a client of several instances does not get more messages per second.
void Instances::flush_next() {
  for (std::size_t i = 0; i < proxies_.size(); ++i) {
    InstanceProxy& proxy = *proxies_[next_++ % proxies_.size()];
    if (proxy.subscriptions().pending()) return proxy.subscriptions().flush();
  }
}

}  // namespace prism::prismweb
