// SPDX-License-Identifier: MIT
// Open HTTP connections, and which one is closed if there are too many.
#pragma once

#include <list>
#include <memory>

namespace prism::prismweb {

struct Connection {
  int fd;                  ///< -1 after closing
  bool is_known = false;   ///< the client sent a valid token or cookie
  bool is_ending = false;  ///< closed to make room
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

  /// Makes room for a new connection. If 128 are open, closes the oldest one of an unknown client. Returns false if the
  /// new connection must be rejected.
  bool make_room();

 private:
  std::list<std::shared_ptr<Connection>> connections_;  ///< oldest first
};

}  // namespace prism::prismweb
