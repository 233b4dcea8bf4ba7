// SPDX-License-Identifier: MIT
#include "tools/prismweb/topics.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "tools/prismweb/json_text.hpp"

namespace prism::prismweb {
namespace {

// The text up to the next quotation mark, where `text` goes on with `head`.
std::string_view quoted_behind(std::string_view text, std::string_view head) {
  if (!text.starts_with(head)) return {};
  const std::size_t end = text.find('"', head.size());
  return end == std::string_view::npos ? std::string_view() : text.substr(head.size(), end - head.size());
}

constexpr std::string_view kHead = R"({"jsonrpc":"2.0","method":")";

}  // namespace

Notification notification_of(std::string_view line) {
  const std::string_view method = quoted_behind(line, kHead);
  if (method.empty()) return {};
  return {method, quoted_behind(line.substr(kHead.size() + method.size()), R"(","params":{"axis":")"), line};
}

void Topics::set(Subscriber* who, const Wish& wish) {
  if (wish_of(who) == wish) return;
  if (wish.any()) hand_over(who);
  for (Topic& topic : topics_) std::erase_if(topic.listeners, [&](const Listener& one) { return one.who == who; });
  std::erase_if(topics_, [](const Topic& topic) { return topic.listeners.empty(); });
  if (!wish.any()) return;
  auto same = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& topic) { return topic.wish == wish; });
  if (same == topics_.end()) same = topics_.insert(topics_.end(), Topic{wish, {}, {}, {}, 0});
  same->listeners.push_back({who, same->lines.size(), same->rows});
}

const Topics::Topic* Topics::topic_of(const Subscriber* who) const {
  const auto hears = [&](const Listener& one) { return one.who == who; };
  const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& topic) {
    return std::any_of(topic.listeners.begin(), topic.listeners.end(), hears);
  });
  return found == topics_.end() ? nullptr : &*found;
}

Wish Topics::wish_of(const Subscriber* who) const {
  const Topic* const topic = topic_of(who);
  return topic == nullptr ? Wish() : topic->wish;
}

Text Topics::batch_of(const Topic& topic, std::size_t from) const {
  std::string_view lines = topic.lines;
  lines.remove_prefix(from);
  if (lines.starts_with(',')) lines.remove_prefix(1);
  return std::make_shared<const std::string>(R"({"instance":)" + json_text(instance_) + R"(,"batch":[)" +
                                             std::string(lines) + "]}");
}

void Topics::hand_over(Subscriber* who) const {
  const Topic* const topic = topic_of(who);
  if (topic == nullptr) return;
  const auto own = std::find_if(topic->listeners.begin(), topic->listeners.end(),
                                [&](const Listener& one) { return one.who == who; });
  const std::uint64_t rows = topic->rows - own->from_rows;
  if (rows > 0) who->deliver(instance_, batch_of(*topic, own->from), rows);
}

std::uint32_t Topics::sample_every() const {
  return std::accumulate(topics_.begin(), topics_.end(), std::uint32_t{0},
                         [](std::uint32_t all, const Topic& topic) { return std::gcd(all, topic.wish.sample_every); });
}

bool Topics::wants(Topic& topic, const Notification& notification, std::uint32_t every) const {
  const Wish& wish = topic.wish;
  const auto named = [&] {
    return notification.axis.empty() || wish.axes.empty() ||
           std::find(wish.axes.begin(), wish.axes.end(), notification.axis) != wish.axes.end();
  };
  if (notification.method == "event") return wish.events;
  if (notification.method == "window") return wish.windows && named();
  if (notification.method != "sample") return true;  // "lost": whoever listens should know
  if (wish.sample_every == 0 || !named()) return false;
  if (wish.sample_every == every) return true;
  auto seen = topic.seen.find(notification.axis);
  if (seen == topic.seen.end()) seen = topic.seen.emplace(notification.axis, 0).first;
  if (seen->second == 0) seen->second = wish.sample_every / every;
  return --seen->second == 0;
}

void Topics::put(const Notification& notification) {
  const std::uint32_t every = sample_every();
  for (Topic& topic : topics_) {
    if (!wants(topic, notification, every)) continue;
    if (!topic.lines.empty()) topic.lines += ',';
    topic.lines += notification.line;
    ++topic.rows;
  }
}

bool Topics::pending() const {
  return std::any_of(topics_.begin(), topics_.end(), [](const Topic& topic) { return topic.rows > 0; });
}

void Topics::flush() {
  struct Due {
    Subscriber* who;
    Text text;
    std::uint64_t rows;
  };
  std::vector<Due> due;  // a subscriber may leave, or go, while it is handed something
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    const Text whole = batch_of(topic, 0);
    for (Listener& one : topic.listeners) {
      const std::uint64_t rows = topic.rows - one.from_rows;
      if (rows > 0) due.push_back({one.who, one.from == 0 ? whole : batch_of(topic, one.from), rows});
      one.from = one.from_rows = 0;
    }
    topic.lines.clear();
    topic.rows = 0;
  }
  for (const Due& one : due) {
    if (wish_of(one.who).any()) one.who->deliver(instance_, one.text, one.rows);
  }
}

}  // namespace prism::prismweb
