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
  for (Topic& topic : topics_) std::erase(topic.subscribers, who);
  std::erase_if(topics_, [](const Topic& topic) { return topic.subscribers.empty(); });
  if (!wish.any()) return;
  auto same = std::find_if(topics_.begin(), topics_.end(), [&](const Topic& topic) { return topic.wish == wish; });
  if (same == topics_.end()) same = topics_.insert(topics_.end(), Topic{wish, {}, {}, {}, 0});
  same->subscribers.push_back(who);
}

Wish Topics::wish_of(const Subscriber* who) const {
  for (const Topic& topic : topics_) {
    if (std::find(topic.subscribers.begin(), topic.subscribers.end(), who) != topic.subscribers.end())
      return topic.wish;
  }
  return {};
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
    std::vector<Subscriber*> subscribers;
    Text text;
    std::uint64_t rows;
  };
  std::vector<Due> due;  // a subscriber may leave, or go, while it is handed something
  const std::string head = R"({"instance":)" + dumped(instance_);
  for (Topic& topic : topics_) {
    if (topic.rows == 0) continue;
    auto text = std::make_shared<const std::string>(head + R"(,"batch":[)" + topic.lines + "]}");
    due.push_back({topic.subscribers, std::move(text), std::exchange(topic.rows, 0)});
    topic.lines.clear();
  }
  for (const Due& one : due) {
    for (Subscriber* who : one.subscribers) {
      if (wish_of(who).any()) who->deliver(instance_, one.text, one.rows);
    }
  }
}

}  // namespace prism::prismweb
