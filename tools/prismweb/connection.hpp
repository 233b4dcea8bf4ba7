// SPDX-License-Identifier: MIT
// Open HTTP connections: their clients, and which one is closed if there are too many.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>

namespace prism::prismweb {

struct Connection {
  int fd;                                 ///< -1 after closing
  std::string address;                    ///< of the client, as address_key() returns it
  std::string user;                       ///< authenticated by password; empty: none
  bool is_known = false;                  ///< the client sent a valid token, cookie or password
  bool is_ending = false;                 ///< closed to make room, or because a password changed
  std::function<void()> on_end;           ///< cancels a pending password check; may be empty
  std::function<void()> close_websocket;  ///< closes a WebSocket with its reason; empty before the upgrade
};

class ConnectionList : public std::enable_shared_from_this<ConnectionList> {
 public:
  static constexpr std::size_t kMaxConnections = 128;

  /// Keeps the connection in the list while in scope.
  class Entry {
   public:
    Entry(std::shared_ptr<ConnectionList> list, std::shared_ptr<Connection> connection);
    ~Entry();
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

   private:
    std::shared_ptr<ConnectionList> list_;
    std::list<std::shared_ptr<Connection>>::iterator at_;
  };

  /// Makes room for a new connection. If 128 are open, closes one of an unknown client. It prefers addresses with
  /// wrong passwords, then addresses with many such connections, then the oldest. Returns false if the new connection
  /// must be rejected.
  bool make_room(const std::function<bool(const std::string& address)>& has_failures);

  /// Closes all connections of these users.
  void close_users(const std::set<std::string>& users);

 private:
  std::list<std::shared_ptr<Connection>> connections_;  ///< oldest first
};

}  // namespace prism::prismweb
