// SPDX-License-Identifier: MIT
// A client's side of prismd's socket: find it, ask it, listen to it.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::client {

/// Sockets in config::socket_folders(), in the order of the folders, whether somebody answers there or not. Invalid
/// names are added to `invalid`, if given (config::sockets_in).
std::vector<std::string> listed_sockets(std::vector<std::string>* invalid = nullptr);

/// Sockets of daemons in config::socket_folders(): those that answer, and those at which systemd starts one for who
/// connects (none is started here).
std::vector<std::string> running_sockets(std::vector<std::string>* invalid = nullptr);

/// The socket to talk to: `socket` where given, else $PRISM_SOCKET, else that of instance `name`, else the only one
/// running. Refused with the names to choose from where there are several.
Result<std::string> find_socket(const std::string& socket, const std::string& name);

class Connection {
 public:
  static Result<Connection> open(const std::string& path);
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&&) = delete;
  ~Connection();

  /// Sends a request; its answer has the id that is returned, and comes by next().
  Result<int> send(const std::string& method, const nlohmann::json& params = nullptr);

  /// Sends a request and waits for its answer (at most 10 s); notifications in between are dropped.
  Result<nlohmann::json> ask(const std::string& method, const nlohmann::json& params = nullptr);

  /// The next line of the daemon, parsed; nothing after timeout_ms (−1: no limit) or where a signal came. Refused where
  /// the daemon went away.
  Result<std::optional<nlohmann::json>> next(int timeout_ms);

  int fd() const { return fd_; }
  const std::string& path() const { return path_; }

 private:
  Connection(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  int fd_;
  std::string path_, pending_;
  int last_id_ = 0;
};

}  // namespace prism::client
