// SPDX-License-Identifier: MIT
#include "tools/client/connection.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/plain_text.hpp"
#include "config/socket_path.hpp"
#include "tools/client/instances.hpp"

namespace prism::client {
namespace {

constexpr int kAnswerTimeoutMs = 10'000;
constexpr int kConnectTimeoutS = 2;
constexpr std::size_t kMaxAnswerBytes = 64 << 20;

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return -1;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval timeout{kConnectTimeoutS, 0};  // a blocked prismd accepts no connection
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
  if (fd >= 0 && ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  errno = error;
  return -1;
}

// Also true without permission to connect: it is running.
bool accepts(const std::string& path) {
  const int fd = connect_to(path);
  if (fd < 0) return errno == EACCES;
  ::close(fd);
  return true;
}

std::string unknown_name(const std::string& name, const std::vector<std::string>& running) {
  const std::string near = nearest_name(name, running);
  const std::string all = fmt::format("{}", fmt::join(running, ", "));
  if (near.empty()) return fmt::format("found \"{}\", expected one of: {}", name, all);
  return fmt::format("found \"{}\", did you mean \"{}\"? Running: {}", name, near, all);
}

}  // namespace

std::vector<std::string> running_sockets(std::vector<std::string>* invalid) {
  std::map<std::string, std::string> found;
  for (const auto& [name, path] : list_instances({}, invalid)) {
    if (found.count(name) == 0 && (config::would_start(path) || accepts(path))) found[name] = path;
  }
  std::vector<std::string> paths;
  for (const auto& [name, path] : found) paths.push_back(path);
  return paths;
}

Result<std::string> find_socket(const std::string& socket, const std::string& name) {
  if (!socket.empty()) return socket;
  const char* environment = std::getenv("PRISM_SOCKET");
  if (name.empty() && environment != nullptr && *environment != '\0') return std::string(environment);
  const std::vector<std::string> running = running_sockets();
  std::vector<std::string> matching, names;
  for (const std::string& path : running) {
    names.push_back(config::instance_name(path));
    if (name.empty() || names.back() == name) matching.push_back(path);
  }
  if (matching.size() == 1) return matching[0];
  if (running.empty())
    return make_error(fmt::format("{}", fmt::join(config::socket_folders(), ", ")),
                      "no prismd answers here; start one, or name its socket with --socket");
  if (matching.empty()) return make_error("--name", unknown_name(name, names));
  return make_error("--name",
                    fmt::format("required if several instances run; choose one of: {}", fmt::join(names, ", ")));
}

Result<DaemonConnection> DaemonConnection::open(const std::string& path) {
  const int fd = connect_to(path);
  if (fd < 0) return make_error(path, fmt::format("no prismd answers: {}", std::strerror(errno)));
  return DaemonConnection(fd, path);
}

DaemonConnection::DaemonConnection(DaemonConnection&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)), pending_(std::move(other.pending_)) {}

DaemonConnection::~DaemonConnection() {
  if (fd_ >= 0) ::close(fd_);
}

Result<int> DaemonConnection::send(const std::string& method, const nlohmann::json& params) {
  nlohmann::json request = {
      {"jsonrpc", "2.0"}, {"id", ++last_id_}, {"method", method}, {"protocol", config::kProtocol}};
  if (!params.is_null()) request["params"] = params;
  const std::string line = json_text(request) + "\n";
  for (std::size_t sent = 0; sent < line.size();) {
    const ssize_t now = ::send(fd_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) return make_error(path_, "prismd closed the connection");
    sent += static_cast<std::size_t>(now);
  }
  return last_id_;
}

Response DaemonConnection::ask(const std::string& method, const nlohmann::json& params) {
  const auto failed = [](config::SocketError code, Error error) {
    return Response(tl::unexpect, RequestError{code, std::move(error)});
  };
  const auto id = send(method, params);
  if (!id) return failed(config::kGone, id.error());
  for (;;) {
    auto message = next(kAnswerTimeoutMs);
    if (!message) return failed(config::kGone, message.error());
    if (!*message)
      return failed(config::kTimeout,
                    {path_, fmt::format("no response to {} within {} s", method, kAnswerTimeoutMs / 1000)});
    const nlohmann::json& its = member(**message, "id");
    if (its == *id || (its.is_null() && (*message)->contains("error")))
      return response_of(method, std::move(**message));
  }
}

Result<std::optional<nlohmann::json>> DaemonConnection::next(int timeout_ms) {
  for (;;) {
    if (const std::size_t end = pending_.find('\n'); end != std::string::npos) {
      const std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      auto message = parse_json_line(line);
      if (!message) return make_error(path_, "found a line that is not JSON; is this prismd's socket?");
      return message;
    }
    if (pending_.size() > kMaxAnswerBytes)
      return make_error(
          path_, fmt::format("found a line longer than {} MiB; is this prismd's socket?", kMaxAnswerBytes >> 20));
    pollfd wait{fd_, POLLIN, 0};
    const int ready = ::poll(&wait, 1, timeout_ms);
    if (ready == 0 || (ready < 0 && errno == EINTR)) return std::optional<nlohmann::json>();
    char buffer[16384];
    const ssize_t size = ::recv(fd_, buffer, sizeof buffer, 0);
    if (size <= 0) return make_error(path_, "prismd closed the connection");
    pending_.append(buffer, static_cast<std::size_t>(size));
  }
}

}  // namespace prism::client
