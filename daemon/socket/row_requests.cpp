// SPDX-License-Identifier: MIT
#include "daemon/socket/row_requests.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

namespace prism::socket {

bool RowRequests::add(boost::asio::any_io_executor executor, Request request) {
  const auto same = [&](const auto& entry) { return entry->request.client == request.client; };
  if (std::any_of(waiting_.begin(), waiting_.end(), same)) return false;
  auto entry = std::make_shared<Entry>(std::move(executor), std::move(request));
  entry->until +=
      std::chrono::duration_cast<Client::Clock::duration>(std::chrono::duration<double>(entry->request.wait_s));
  waiting_.push_back(entry);
  read(entry);
  return true;
}

void RowRequests::synced() {
  const Entries all = waiting_;
  for (const auto& entry : all) {
    if (entry->reading) {
      entry->asked_again = true;
    } else if (entry->request.client->open()) {
      read(entry);
    } else {
      waiting_.remove(entry);
    }
  }
}

// The disk thread reads the page and posts it to the live thread. The entry stays in the list during the read, so that
// it is never destroyed on the disk thread.
void RowRequests::read(const std::shared_ptr<Entry>& entry) {
  entry->reading = true;
  entry->asked_again = false;
  entry->request.log->read(entry->request.query, [this, alive = std::weak_ptr(alive_), asked = std::weak_ptr(entry),
                                                  executor = entry->executor](pipeline::RowResult page) {
    auto found = std::make_shared<pipeline::RowResult>(std::move(page));
    boost::asio::post(executor, [this, alive, asked, found] {
      const auto still = alive.expired() ? nullptr : asked.lock();
      if (still) take(still, std::move(*found));
    });
  });
}

void RowRequests::take(const std::shared_ptr<Entry>& entry, pipeline::RowResult page) {
  entry->reading = false;
  const bool late = Client::Clock::now() >= entry->until;
  if (!page || page->rows > 0 || page->missing > 0 || late || !entry->request.client->open())
    return end(entry, std::move(page));
  if (entry->asked_again) return read(entry);
  entry->timer.expires_at(entry->until);
  entry->timer.async_wait([this, alive = std::weak_ptr(alive_), entry](boost::system::error_code error) {
    if (!error && !alive.expired() && !entry->reading) read(entry);
  });
}

void RowRequests::end(const std::shared_ptr<Entry>& entry, pipeline::RowResult page) {
  entry->timer.cancel();
  waiting_.remove(entry);
  entry->request.answer(std::move(page));
}

}  // namespace prism::socket
