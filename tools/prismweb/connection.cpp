// SPDX-License-Identifier: MIT
#include "tools/prismweb/connection.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <utility>

namespace prism::prismweb {

ConnectionList::Entry::Entry(std::shared_ptr<ConnectionList> list, std::shared_ptr<Connection> connection)
    : list_(std::move(list)), at_(list_->connections_.insert(list_->connections_.end(), std::move(connection))) {}

ConnectionList::Entry::~Entry() { list_->connections_.erase(at_); }

bool ConnectionList::make_room() {
  const auto is_ending = [](const auto& connection) { return connection->is_ending; };
  const auto ending = static_cast<std::size_t>(std::count_if(connections_.begin(), connections_.end(), is_ending));
  if (connections_.size() - ending < kMaxConnections) return ending < kMaxConnections;
  const auto oldest = std::find_if(connections_.begin(), connections_.end(), [](const auto& connection) {
    return !connection->is_known && !connection->is_ending;
  });
  if (oldest == connections_.end()) return false;
  (*oldest)->is_ending = true;
  if ((*oldest)->fd >= 0) ::shutdown((*oldest)->fd, SHUT_RDWR);
  return true;
}

}  // namespace prism::prismweb
