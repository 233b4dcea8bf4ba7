// SPDX-License-Identifier: MIT
#include "tools/prismweb/connection.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace prism::prismweb {
namespace {

void end(Connection& connection) {
  connection.is_ending = true;
  if (connection.on_end) connection.on_end();
  if (connection.fd >= 0) ::shutdown(connection.fd, SHUT_RDWR);
}

}  // namespace

ConnectionList::Entry::Entry(std::shared_ptr<ConnectionList> list, std::shared_ptr<Connection> connection)
    : list_(std::move(list)), at_(list_->connections_.insert(list_->connections_.end(), std::move(connection))) {}

ConnectionList::Entry::~Entry() { list_->connections_.erase(at_); }

bool ConnectionList::make_room(const std::function<bool(const std::string& address)>& has_failures) {
  const auto is_ending = [](const auto& connection) { return connection->is_ending; };
  const auto ending = static_cast<std::size_t>(std::count_if(connections_.begin(), connections_.end(), is_ending));
  if (connections_.size() - ending < kMaxConnections) return ending < kMaxConnections;
  std::map<std::string, int> unknown_of;
  for (const auto& connection : connections_) {
    if (!connection->is_known && !connection->is_ending) ++unknown_of[connection->address];
  }
  std::shared_ptr<Connection> worst;
  std::pair<bool, int> worst_rank;
  for (const auto& connection : connections_) {
    if (connection->is_known || connection->is_ending) continue;
    const std::pair<bool, int> rank(has_failures(connection->address), unknown_of[connection->address]);
    if (worst && rank <= worst_rank) continue;
    worst = connection;
    worst_rank = rank;
  }
  if (!worst) return false;
  end(*worst);
  return true;
}

void ConnectionList::close_users(const std::set<std::string>& users) {
  const std::vector<std::shared_ptr<Connection>> all(connections_.begin(), connections_.end());
  for (const auto& connection : all) {
    if (!users.contains(connection->user)) continue;
    if (!connection->close_websocket) {
      end(*connection);
      continue;
    }
    connection->is_ending = true;
    connection->close_websocket();
  }
}

}  // namespace prism::prismweb
