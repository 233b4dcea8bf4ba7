// SPDX-License-Identifier: MIT
// Abusive clients: each is a separate process at nice 19 that runs until it is killed.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/live_program.hpp"

namespace prism::bench {

inline std::string request(const std::string& method, const std::string& params = "{}", bool with_id = true) {
  return std::string(R"({"jsonrpc":"2.0","protocol":2,)") + (with_id ? R"("id":1,)" : "") + R"("method":")" + method +
         R"(","params":)" + params + "}";
}
inline std::string hour_of_history() { return request("history", R"({"seconds":3600})"); }

inline bool send_text(int fd, const std::string& text) {
  return ::send(fd, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
}

/// Reads until this number of lines has arrived. Returns false if the daemon closed the connection.
inline bool read_lines(int fd, std::size_t lines) {
  static std::vector<char> buffer(1 << 20);
  while (lines > 0) {
    const ssize_t size = ::read(fd, buffer.data(), buffer.size());
    if (size <= 0) return false;
    const auto received = static_cast<std::size_t>(std::count(buffer.begin(), buffer.begin() + size, '\n'));
    lines -= std::min(lines, received);
  }
  return true;
}

/// Calls `harm(number)` repeatedly in each of `count` processes.
class Abusers {
 public:
  Abusers(int count, const std::function<void(int)>& harm) {
    for (int number = 0; number < count; ++number) {
      const pid_t child = ::fork();
      if (child == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        ::setpriority(PRIO_PROCESS, 0, 19);
        for (;;) harm(number);
      }
      children_.push_back(child);
    }
  }
  ~Abusers() {
    for (const pid_t child : children_) ::kill(child, SIGKILL), ::waitpid(child, nullptr, 0);
  }
  Abusers(const Abusers&) = delete;
  Abusers& operator=(const Abusers&) = delete;

 private:
  std::vector<pid_t> children_;
};

/// Four clients that each send `text`, with a response of `lines` lines, as soon as they have read the last response.
inline std::unique_ptr<Abusers> four_that_ask(const std::string& socket, const std::string& text, std::size_t lines) {
  return std::make_unique<Abusers>(4, [=](int) {
    const int fd = connect_with_patience(socket);
    while (send_text(fd, text + "\n") && read_lines(fd, lines)) {
    }
    ::close(fd);
  });
}

}  // namespace prism::bench
