// SPDX-License-Identifier: MIT
// The raw bytes of a line for other programs: all readers get them, and a slow one is disconnected.
#include "drivers/transport/raw_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace prism::transport {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

Descriptor reader_at(int port) {
  Descriptor reader(::socket(AF_INET, SOCK_STREAM, 0));
  const sockaddr_in address = loopback(port);
  EXPECT_EQ(::connect(reader.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return reader;
}

int unused_port() {
  const Descriptor probe(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  ::bind(probe.get(), reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(probe.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

TEST(RawServer, AllReadersGetTheBytesAndASlowOneIsDisconnected) {
  const int port = unused_port();
  const auto server = RawServer::open("127.0.0.1:" + std::to_string(port));
  ASSERT_TRUE(server) << server.error().text();
  const Descriptor slow = reader_at(port), good = reader_at(port);
  Descriptor gone = reader_at(port);
  (*server)->accept_and_forget();
  EXPECT_EQ((*server)->readers(), 3u);
  gone.reset();
  (*server)->accept_and_forget();
  EXPECT_EQ((*server)->readers(), 2u);
  const std::vector<std::uint8_t> bytes(100'000, 0x55);
  std::vector<std::uint8_t> got(bytes.size());
  for (int i = 0; i < 200; ++i) {
    (*server)->send(bytes);
    ASSERT_EQ(::recv(good.get(), got.data(), got.size(), MSG_WAITALL), static_cast<ssize_t>(bytes.size())) << i;
  }
  EXPECT_EQ((*server)->readers(), 1u);
  EXPECT_EQ((*server)->dropped(), 1u);
  const auto second = RawServer::open("127.0.0.1:" + std::to_string(port));
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("Address already in use"), std::string::npos);
}

}  // namespace
}  // namespace prism::transport
