// SPDX-License-Identifier: MIT
// The lower bound of the live benchmark: polls, reads, and writes one line as long as prismd's for each frame.
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

// "127.0.0.1:4001": the lower bound of a line through TCP
int open_tcp(const char* device) {
  const char* const colon = std::strchr(device, ':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(std::strtoul(colon + 1, nullptr, 10)));
  const int line = ::socket(AF_INET, SOCK_STREAM, 0);
  return ::connect(line, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 ? line : -1;
}

// usage: bench_relay DEVICE SOCKET FRAME_BYTES LINE_BYTES
int main(int argc, char** argv) {
  if (argc != 5) return 64;
  const std::size_t frame_bytes = std::strtoul(argv[3], nullptr, 10);
  const std::string line = std::string(std::strtoul(argv[4], nullptr, 10) - 1, 'x') + "\n";
  const bool tcp = std::strchr(argv[1], ':') != nullptr;
  const int device = tcp ? open_tcp(argv[1]) : ::open(argv[1], O_RDWR | O_NOCTTY | O_NONBLOCK);
  termios raw{};
  ::tcgetattr(device, &raw);
  ::cfmakeraw(&raw);
  ::tcsetattr(device, TCSANOW, &raw);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, argv[2], sizeof address.sun_path - 1);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener, 1) != 0)
    return 1;
  const int client = ::accept(listener, nullptr, nullptr);
  std::vector<char> buffer(65536);
  std::size_t pending = 0;
  for (;;) {
    pollfd wait{device, POLLIN, 0};
    if (::poll(&wait, 1, -1) < 0) return 1;
    const ssize_t size = ::read(device, buffer.data(), buffer.size());
    if (size == 0 || (size < 0 && errno != EAGAIN)) return 0;
    if (size < 0) continue;
    for (pending += static_cast<std::size_t>(size); pending >= frame_bytes; pending -= frame_bytes) {
      if (::write(client, line.data(), line.size()) < 0) return 0;
    }
  }
}
