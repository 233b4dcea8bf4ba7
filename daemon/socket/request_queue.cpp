// SPDX-License-Identifier: MIT
#include "daemon/socket/request_queue.hpp"

#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>
#include <utility>

namespace prism::socket {

struct RequestQueue::Entry {
  std::shared_ptr<Client> client;
  std::deque<std::string> lines;
  std::function<void()> done;
  std::deque<nlohmann::json> requests;  // of the current line
};

void RequestQueue::add(std::shared_ptr<Client> client, std::deque<std::string> lines, std::function<void()> done) {
  queue_.push_back(std::make_shared<Entry>(Entry{std::move(client), std::move(lines), std::move(done), {}}));
  post();
}

void RequestQueue::post() {
  if (std::exchange(posted_, true)) return;
  boost::asio::post(executor_, [this, alive = std::weak_ptr(alive_)] {
    if (!alive.expired()) run();
  });
}

void RequestQueue::run() {
  posted_ = false;
  const auto end = std::chrono::steady_clock::now() + kSlice;
  while (!queue_.empty()) {
    std::shared_ptr<Entry> entry = std::move(queue_.front());
    queue_.pop_front();
    if (!step(*entry)) {
      entry->done();
    } else if (entry->requests.empty()) {
      queue_.push_back(std::move(entry));  // line finished: the next client follows
    } else {
      queue_.push_front(std::move(entry));  // one parsed batch at a time: it needs ten times the memory of its text
    }
    if (std::chrono::steady_clock::now() >= end) break;
  }
  if (!queue_.empty()) post();
}

bool RequestQueue::step(Entry& entry) {
  if (entry.client->open() && entry.client->gone()) entry.client->close();
  if (!entry.client->open()) return false;
  if (entry.requests.empty()) {
    if (entry.lines.empty()) return false;
    entry.requests = rpc_.take(entry.client, entry.lines.front());
    entry.lines.pop_front();
  } else {
    rpc_.one(entry.client, std::move(entry.requests.front()));
    entry.requests.pop_front();
  }
  return !entry.requests.empty() || !entry.lines.empty();
}

}  // namespace prism::socket
