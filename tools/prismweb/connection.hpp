// SPDX-License-Identifier: MIT
// The connections that are served: who sent them, and which one ends if there are too many.
#pragma once

#include <functional>
#include <list>
#include <memory>
#include <set>
#include <string>

namespace prism::prismweb {

/// A connection, as long as it is served.
struct Connection {
  int fd;                                 ///< -1 after it was closed
  std::string address;                    ///< of the client, as address_key() returns it
  std::string user;                       ///< whose password the client sent; empty if none
  bool is_known = false;                  ///< the client has sent a token, a cookie or a password that is right
  bool is_ending = false;                 ///< it was closed to make room, or because a password changed
  std::function<void()> on_end;           ///< ends what the connection waits for, if it waits
  std::function<void()> close_websocket;  ///< closes a WebSocket with its reason; empty before the upgrade
};

class ConnectionList : public std::enable_shared_from_this<ConnectionList> {
 public:
  static constexpr std::size_t kMaxConnections = 128;

  /// Removes the connection from the list when it goes out of scope.
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

  /// Makes room for one more connection. If 128 are served, one of an unknown client ends: of an address with wrong
  /// passwords before others, of an address with many before one with few, the oldest first. Returns false if there is
  /// none to end.
  bool make_room(const std::function<bool(const std::string& address)>& has_failures);

  /// Ends all connections of these users.
  void close_users(const std::set<std::string>& users);

 private:
  std::list<std::shared_ptr<Connection>> connections_;  ///< the oldest first
};

}  // namespace prism::prismweb
