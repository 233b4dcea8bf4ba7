// SPDX-License-Identifier: MIT
#include "tools/prismweb/subscription_table.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {
namespace {

// Returns the text between `head` and the next quotation mark; empty if `text` does not begin with `head`.
std::string_view quoted_after(std::string_view text, std::string_view head) {
  if (!text.starts_with(head)) return {};
  const std::size_t end = text.find('"', head.size());
  return end == std::string_view::npos ? std::string_view() : text.substr(head.size(), end - head.size());
}

constexpr std::string_view kHead = R"({"jsonrpc":"2.0","method":")";

}  // namespace

Notification notification_of(std::string_view line) {
  const std::string_view method = quoted_after(line, kHead);
  if (method.empty()) return {};
  return {method, quoted_after(line.substr(kHead.size() + method.size()), R"(","params":{"axis":")"), line};
}

void SubscriptionTable::set(Subscriber* subscriber, const Subscription& subscription) {
  if (subscription_of(subscriber) == subscription) return;
  if (subscription.any()) deliver_pending(subscriber);
  for (Group& group : subscriptions_)
    std::erase_if(group.listeners, [&](const Listener& one) { return one.subscriber == subscriber; });
  std::erase_if(subscriptions_, [](const Group& group) { return group.listeners.empty(); });
  if (!subscription.any()) return;
  auto same = std::find_if(subscriptions_.begin(), subscriptions_.end(),
                           [&](const Group& group) { return group.subscription == subscription; });
  if (same == subscriptions_.end())
    same = subscriptions_.insert(subscriptions_.end(), Group{subscription, {}, {}, {}, 0});
  same->listeners.push_back({subscriber, same->lines.size(), same->rows});
}

const SubscriptionTable::Group* SubscriptionTable::group_of(const Subscriber* subscriber) const {
  const auto is_listener = [&](const Listener& one) { return one.subscriber == subscriber; };
  const auto found = std::find_if(subscriptions_.begin(), subscriptions_.end(), [&](const Group& group) {
    return std::any_of(group.listeners.begin(), group.listeners.end(), is_listener);
  });
  return found == subscriptions_.end() ? nullptr : &*found;
}

Subscription SubscriptionTable::subscription_of(const Subscriber* subscriber) const {
  const Group* const group = group_of(subscriber);
  return group == nullptr ? Subscription() : group->subscription;
}

Text SubscriptionTable::batch_of(const Group& group, std::size_t from) const {
  std::string_view lines = group.lines;
  lines.remove_prefix(from);
  if (lines.starts_with(',')) lines.remove_prefix(1);
  return std::make_shared<const std::string>(R"({"instance":)" + json_text(instance_) + R"(,"batch":[)" +
                                             std::string(lines) + "]}");
}

void SubscriptionTable::deliver_pending(Subscriber* subscriber) const {
  const Group* const group = group_of(subscriber);
  if (group == nullptr) return;
  const auto own = std::find_if(group->listeners.begin(), group->listeners.end(),
                                [&](const Listener& one) { return one.subscriber == subscriber; });
  const std::uint64_t rows = group->rows - own->from_rows;
  if (rows > 0) subscriber->deliver(instance_, batch_of(*group, own->from), rows);
}

std::uint32_t SubscriptionTable::sample_every() const {
  return std::accumulate(
      subscriptions_.begin(), subscriptions_.end(), std::uint32_t{0},
      [](std::uint32_t all, const Group& group) { return std::gcd(all, group.subscription.sample_every); });
}

bool SubscriptionTable::wants(Group& group, const Notification& notification, std::uint32_t every) const {
  const Subscription& subscription = group.subscription;
  const auto named = [&] {
    return notification.axis.empty() || subscription.axes.empty() ||
           std::find(subscription.axes.begin(), subscription.axes.end(), notification.axis) != subscription.axes.end();
  };
  if (notification.method == "event") return subscription.events;
  if (notification.method == "window") return subscription.windows && named();
  if (notification.method != "sample") return true;  // "lost" concerns all subscribers
  if (subscription.sample_every == 0 || !named()) return false;
  if (subscription.sample_every == every) return true;
  auto remaining = group.remaining.find(notification.axis);
  if (remaining == group.remaining.end()) remaining = group.remaining.emplace(notification.axis, 0).first;
  if (remaining->second == 0) remaining->second = subscription.sample_every / every;
  return --remaining->second == 0;
}

void SubscriptionTable::put(const Notification& notification) {
  const std::uint32_t every = sample_every();
  for (Group& group : subscriptions_) {
    if (!wants(group, notification, every)) continue;
    if (!group.lines.empty()) group.lines += ',';
    group.lines += notification.line;
    ++group.rows;
  }
}

bool SubscriptionTable::pending() const {
  return std::any_of(subscriptions_.begin(), subscriptions_.end(), [](const Group& group) { return group.rows > 0; });
}

void SubscriptionTable::flush() {
  struct Due {
    Subscriber* subscriber;
    Text text;
    std::uint64_t rows;
  };
  std::vector<Due> due;  // deliver() may end subscriptions and destroy subscribers
  for (Group& group : subscriptions_) {
    if (group.rows == 0) continue;
    const Text full = batch_of(group, 0);
    for (Listener& one : group.listeners) {
      const std::uint64_t rows = group.rows - one.from_rows;
      if (rows > 0) due.push_back({one.subscriber, one.from == 0 ? full : batch_of(group, one.from), rows});
      one.from = one.from_rows = 0;
    }
    group.lines.clear();
    group.rows = 0;
  }
  for (const Due& one : due) {
    if (subscription_of(one.subscriber).any()) one.subscriber->deliver(instance_, one.text, one.rows);
  }
}

}  // namespace prism::prismweb
