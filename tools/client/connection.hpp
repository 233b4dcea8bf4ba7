// SPDX-License-Identifier: MIT
// Client of prismd's socket: finds it, sends requests, receives notifications.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/client/response.hpp"

namespace prism::client {

/// Returns the sockets in config::socket_folders() that accept connections, and those on which systemd starts a daemon
/// at the first connection (this call starts none); the first of equal names.
std::vector<std::string> running_sockets(std::vector<std::string>* invalid = nullptr);

/// Returns `socket` if given, else $PRISM_SOCKET, else the socket of instance `name`, else that of the only running
/// instance. Errors: none or several are running, or the name is unknown.
Result<std::string> find_socket(const std::string& socket, const std::string& name);

class DaemonConnection {
 public:
  static Result<DaemonConnection> open(const std::string& path);
  DaemonConnection(DaemonConnection&& other) noexcept;
  DaemonConnection& operator=(DaemonConnection&&) = delete;
  ~DaemonConnection();

  /// Sends a request. Returns its id; next() returns the response with this id.
  Result<int> send(const std::string& method, const nlohmann::json& params = nullptr);

  /// Sends a request and waits for the response (at most 10 s). Drops notifications received before it. An error
  /// without an id is also the response: prismd rejected the connection.
  Response ask(const std::string& method, const nlohmann::json& params = nullptr);

  /// Returns the next message of the daemon; nullopt after timeout_ms (−1: no limit) or a signal. Errors: the daemon
  /// closed the connection, or sent invalid data.
  Result<std::optional<nlohmann::json>> next(int timeout_ms);

  int fd() const { return fd_; }
  const std::string& path() const { return path_; }

 private:
  DaemonConnection(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  int fd_;
  std::string path_, pending_;
  int last_id_ = 0;
};

}  // namespace prism::client
