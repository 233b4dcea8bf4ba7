// SPDX-License-Identifier: MIT
// Lines through TCP and UDP on the loopback interface: open in steps, never wait, report why they failed.
#include "drivers/transport/network_line.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "drivers/transport/transport.hpp"
#include "tests/support/blocks.hpp"

namespace prism::transport {
namespace {

using Kind = Received::Kind;
using testing::HasSubstr, testing::IsEmpty, testing::StartsWith;

/// A socket of the device's or a reader's end.
class Far {
 public:
  explicit Far(int type) : socket_(::socket(AF_INET, type | SOCK_CLOEXEC, 0)) {
    sockaddr_in any = at(0);
    EXPECT_EQ(::bind(fd(), reinterpret_cast<sockaddr*>(&any), sizeof any), 0);
  }
  int fd() const { return socket_.get(); }
  int port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    ::getsockname(fd(), reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }
  void listen() const { ::listen(fd(), 1); }
  Descriptor accept() const { return Descriptor(::accept(fd(), nullptr, nullptr)); }
  bool connect(int port) const {
    sockaddr_in to = at(port);
    return ::connect(fd(), reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
  }
  void close() { socket_.reset(); }

 private:
  static sockaddr_in at(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }
  Descriptor socket_;
};

int free_port(int type) { return Far(type).port(); }

void put(int fd, const std::string& text) {
  ASSERT_EQ(::write(fd, text.data(), text.size()), static_cast<ssize_t>(text.size()));
}

Settings on(const char* type, bool listens, const std::string& address, const std::string& from = "") {
  Settings settings;
  settings.network = {type, address, listens, from};
  return settings;
}

boost::asio::io_context& io() {
  static boost::asio::io_context io;
  return io;
}

struct Outcome {
  std::string bytes, why;
};

// Reads when the line is ready, as the daemon does, until data came or the line was lost, at most `for_ms`.
Outcome outcome(Transport& line, int for_ms = 3000, bool until_open = false) {
  std::array<std::uint8_t, 4096> buffer;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(for_ms);
  const auto ready = std::make_shared<bool>(true);
  while (std::chrono::steady_clock::now() < end && !(until_open && line.opening().empty())) {
    if (std::exchange(*ready, false)) line.wait([ready](const auto& error) { *ready = *ready || !error; });
    io().restart();
    io().run_one_for(std::chrono::milliseconds(50));
    if (!*ready) continue;
    const Received received = line.read(buffer);
    if (received.kind == Kind::kLost) return {"", received.why};
    if (received.kind == Kind::kData)
      return {std::string(reinterpret_cast<const char*>(buffer.data()), received.bytes), ""};
  }
  return {};
}

std::string open_it(Transport& line) {
  const std::string why = outcome(line, 3000, true).why;
  return why + line.opening();
}

std::unique_ptr<Transport> opened(const Settings& settings) {
  auto line = open(io(), settings);
  EXPECT_TRUE(line) << line.error().text();
  return line ? std::move(*line) : nullptr;
}

TEST(TcpLine, ConnectsAndCarriesBytesBothWays) {
  Far device(SOCK_STREAM);
  device.listen();
  const auto line = opened(on("tcp", false, "127.0.0.1:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  const Descriptor peer = device.accept();
  EXPECT_EQ(open_it(*line), "");
  put(peer.get(), "frame");
  EXPECT_EQ(outcome(*line).bytes, "frame");
  const std::array<std::uint8_t, 2> question{'?', '\r'};
  EXPECT_EQ(line->write(question).value(), 2u);
  char got[8] = "";
  EXPECT_EQ(::read(peer.get(), got, sizeof got), 2);
  put(peer.get(), "more");
  pollfd readable{line->fd(), POLLIN, 0};
  ::poll(&readable, 1, 1000);
  EXPECT_TRUE(line->has_unread());
}

TEST(TcpLine, WritesNoByteThatDoesNotFit) {
  Far device(SOCK_STREAM);
  device.listen();
  const auto line = opened(on("tcp", false, "127.0.0.1:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  EXPECT_EQ(open_it(*line), "");
  const std::vector<std::uint8_t> bytes(1 << 20);
  for (std::size_t written = 1; written > 0;) {
    const auto done = line->write(bytes);
    ASSERT_TRUE(done) << done.error().text();
    written = *done;
  }
}

TEST(TcpLine, AsksTheKernelToFindAPeerThatIsGone) {
  Far device(SOCK_STREAM);
  device.listen();
  const auto line = opened(on("tcp", false, "127.0.0.1:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  EXPECT_EQ(open_it(*line), "");
  const auto option = [&](int level, int name) {
    int value = -1;
    socklen_t size = sizeof value;
    ::getsockopt(line->fd(), level, name, &value, &size);
    return value;
  };
  EXPECT_EQ(option(SOL_SOCKET, SO_KEEPALIVE), 1);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPIDLE), 10);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPINTVL), 5);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_KEEPCNT), 2);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 20'000);
  EXPECT_EQ(option(IPPROTO_TCP, TCP_NODELAY), 1);
}

TEST(TcpLine, ReportsThatTheOtherEndClosed) {
  Far device(SOCK_STREAM);
  device.listen();
  const auto line = opened(on("tcp", false, "127.0.0.1:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  device.accept().reset();
  EXPECT_EQ(open_it(*line), "");
  EXPECT_EQ(outcome(*line).why, "the other end closed the connection");
}

TEST(TcpLine, ReportsARefusedConnection) {
  const std::string address = "127.0.0.1:" + std::to_string(free_port(SOCK_STREAM));
  auto line = open(io(), on("tcp", false, address));
  const std::string why = line ? outcome(**line).why : line.error().text();
  EXPECT_THAT(why, HasSubstr(address + ": connection refused"));
}

TEST(TcpLine, AnAddressThatDoesNotAnswerIsGivenUpAfterFiveSeconds) {
  Far device(SOCK_STREAM);
  ::listen(device.fd(), 0);
  std::vector<Far> others;  // fill the queue: the kernel then ignores further SYNs
  for (int i = 0; i < 3; ++i) {
    others.emplace_back(SOCK_STREAM | SOCK_NONBLOCK);
    others.back().connect(device.port());
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto line = opened(on("tcp", false, "127.0.0.1:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(500));
  EXPECT_THAT(line->opening(), StartsWith("connecting to 127.0.0.1:"));
  EXPECT_THAT(outcome(*line, 8000).why, HasSubstr(": no answer within 5 s"));
}

TEST(TcpLine, LooksUpNamesAndTriesAllTheirAddresses) {
  Far device(SOCK_STREAM);  // 127.0.0.1 only; localhost may also be ::1
  device.listen();
  const auto line = opened(on("tcp", false, "localhost:" + std::to_string(device.port())));
  ASSERT_TRUE(line);
  EXPECT_EQ(open_it(*line), "");
  const auto unknown = opened(on("tcp", false, "no-such-host.invalid:4001"));
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->opening(), "looking up no-such-host.invalid");
  EXPECT_THAT(outcome(*unknown, 20000).why, StartsWith("no-such-host.invalid: "));
}

TEST(TcpLine, WaitsForOnePeerAndTurnsOthersAway) {
  const int port = free_port(SOCK_STREAM);
  const auto line = opened(on("tcp", true, "127.0.0.1:" + std::to_string(port)));
  ASSERT_TRUE(line);
  EXPECT_EQ(line->opening(), "waiting for a connection to 127.0.0.1:" + std::to_string(port));
  Far device(SOCK_STREAM), other(SOCK_STREAM);
  ASSERT_TRUE(device.connect(port));
  EXPECT_EQ(open_it(*line), "");
  ASSERT_TRUE(other.connect(port));
  put(device.fd(), "frame");
  EXPECT_EQ(outcome(*line).bytes, "frame");
  EXPECT_EQ(line->turn_away(), "127.0.0.1");
  EXPECT_EQ(line->turn_away(), "");
  char got = 0;
  EXPECT_LE(::read(other.fd(), &got, 1), 0) << "the other peer must be disconnected";
  device.close();
  EXPECT_EQ(outcome(*line).why, "the other end closed the connection");
}

TEST(TcpLine, AnAddressInUseIsAnError) {
  Far device(SOCK_STREAM);
  device.listen();
  const std::string address = "127.0.0.1:" + std::to_string(device.port());
  const auto line = open(io(), on("tcp", true, address));
  ASSERT_FALSE(line);
  EXPECT_EQ(line.error().text(), "tcp listening on " + address + ": " + address + ": Address already in use");
}

TEST(UdpLine, OneDatagramIsOneRead) {
  const int port = free_port(SOCK_DGRAM);
  const auto line = opened(on("udp", true, "127.0.0.1:" + std::to_string(port)));
  ASSERT_TRUE(line);
  EXPECT_EQ(line->opening(), "");
  Far device(SOCK_DGRAM);
  ASSERT_TRUE(device.connect(port));
  for (const char* text : {"one", "", "two"}) put(device.fd(), text);
  EXPECT_EQ(outcome(*line).bytes, "one");
  EXPECT_EQ(outcome(*line).bytes, "two");
  const std::array<std::uint8_t, 1> question{'?'};
  EXPECT_EQ(line->write(question).value(), 1u);
  char got = 0;
  EXPECT_EQ(::read(device.fd(), &got, 1), 1);
}

std::string received(const Far& device, int& from_port) {
  char text[16] = "";
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const auto got = ::recvfrom(device.fd(), text, sizeof text, 0, reinterpret_cast<sockaddr*>(&from), &size);
  from_port = ntohs(from.sin_port);
  return {text, static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
}

// Bytes go to the address of the device, also before and after a datagram from another port.
TEST(UdpLine, SendsToTheConfiguredAddress) {
  const std::array<std::uint8_t, 1> question{'?'};
  const Far device(SOCK_DGRAM), other(SOCK_DGRAM);
  const std::string address = "127.0.0.1:" + std::to_string(device.port());
  const std::string here = "127.0.0.1:" + std::to_string(free_port(SOCK_DGRAM));
  for (const Settings& settings : {on("udp", false, address), on("udp", true, here, address)}) {
    const auto line = opened(settings);
    ASSERT_TRUE(line);
    int port = 0;
    EXPECT_EQ(line->write(question).value(), 1u);
    EXPECT_EQ(received(device, port), "?");
    ASSERT_TRUE(other.connect(port));
    put(other.fd(), "other");
    EXPECT_EQ(outcome(*line).bytes, "other");
    EXPECT_EQ(line->write(question).value(), 1u);
    EXPECT_EQ(received(device, port), "?");
  }
}

TEST(UdpLine, ADatagramThatIsTooLongIsAnError) {
  const std::string address = "127.0.0.1:" + std::to_string(free_port(SOCK_DGRAM));
  const auto line = opened(on("udp", false, address));
  ASSERT_TRUE(line);
  const auto done = line->write(std::vector<std::uint8_t>(1 << 16));
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().text(), "udp " + address + ": cannot write: Message too long");
}

TEST(UdpLine, IgnoresOtherHosts) {
  const int port = free_port(SOCK_DGRAM);
  const auto line = opened(on("udp", true, "127.0.0.1:" + std::to_string(port), "127.0.0.2"));
  ASSERT_TRUE(line);
  Far device(SOCK_DGRAM);
  ASSERT_TRUE(device.connect(port));
  put(device.fd(), "other");
  EXPECT_EQ(outcome(*line, 300).bytes, "");
  const std::array<std::uint8_t, 1> question{'?'};
  EXPECT_THAT(line->write(question).error().text(), HasSubstr("no datagram came yet"));
}

TEST(NetworkLine, IsDescribed) {
  EXPECT_EQ(describe(on("tcp", false, "server:4001")), "tcp server:4001");
  EXPECT_EQ(describe(on("tcp", true, "[::1]:4001")), "tcp listening on [::1]:4001");
  EXPECT_EQ(describe(on("udp", true, "0.0.0.0:4002")), "udp 0.0.0.0:4002");
  EXPECT_TRUE(needs_network(on("udp", true, "0.0.0.0:4002")));
  Settings serial;
  serial.device = "/dev/null";
  EXPECT_FALSE(needs_network(serial));
  EXPECT_EQ(describe(serial), "/dev/null");
  EXPECT_TRUE(is_present(serial));
  serial.device = "/dev/no-such-line";
  EXPECT_FALSE(is_present(serial));
}

std::string read(const char* text) {
  const auto endpoint = parse_endpoint(text);
  return endpoint ? endpoint->host + " " + std::to_string(endpoint->port) : endpoint.error();
}

TEST(Endpoint, HostAndPort) {
  for (const test::Block& row : test::blocks("transport/endpoint.txt", 2))
    EXPECT_EQ(read(row[0].c_str()), row[1]) << row.where;
  EXPECT_EQ(read(""), "is empty, expected HOST:PORT");
}

TEST(Endpoint, NumericWithOrWithoutAPort) {
  EXPECT_EQ(parse_numeric_endpoint("192.0.2.7").value(), (Endpoint{"192.0.2.7"}));
  EXPECT_EQ(parse_numeric_endpoint("192.0.2.7:4001").value(), (Endpoint{"192.0.2.7", 4001}));
  EXPECT_EQ(parse_numeric_endpoint("::1").value(), (Endpoint{"::1"}));
  EXPECT_EQ(parse_numeric_endpoint("[::1]:4001").value(), (Endpoint{"::1", 4001}));
  EXPECT_EQ(parse_numeric_endpoint("fe80::1%lo").value(), (Endpoint{"fe80::1%lo"}));
  EXPECT_EQ(parse_numeric_endpoint("gyro").error(), "found \"gyro\", expected an IP address");
  EXPECT_EQ(parse_numeric_endpoint("gyro:4001").error(), "found \"gyro:4001\", expected an IP address");
}

}  // namespace
}  // namespace prism::transport
