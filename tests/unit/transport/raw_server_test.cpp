// SPDX-License-Identifier: MIT
// The raw bytes of a line for other programs: all readers get them, and a slow one is disconnected.
#include "drivers/transport/raw_server.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <string>
#include <vector>

#include "tests/unit/transport/far_end.hpp"

namespace prism::transport {
namespace {

Far reader_at(int port) {
  Far reader(SOCK_STREAM);
  EXPECT_TRUE(reader.connect(port));
  return reader;
}

TEST(RawServer, AllReadersGetTheBytesAndASlowOneIsDisconnected) {
  const int port = free_port(SOCK_STREAM);
  const auto server = RawServer::open("127.0.0.1:" + std::to_string(port));
  ASSERT_TRUE(server) << server.error().text();
  const Far slow = reader_at(port), good = reader_at(port);
  Far gone = reader_at(port);
  (*server)->accept_and_forget();
  EXPECT_EQ((*server)->readers(), 3u);
  gone.close();
  (*server)->accept_and_forget();
  EXPECT_EQ((*server)->readers(), 2u);
  const std::vector<std::uint8_t> bytes(100'000, 0x55);
  std::vector<std::uint8_t> got(bytes.size());
  for (int i = 0; i < 200; ++i) {
    (*server)->send(bytes);
    ASSERT_EQ(::recv(good.fd(), got.data(), got.size(), MSG_WAITALL), static_cast<ssize_t>(bytes.size())) << i;
  }
  EXPECT_EQ((*server)->readers(), 1u);
  EXPECT_EQ((*server)->dropped(), 1u);
  const auto second = RawServer::open("127.0.0.1:" + std::to_string(port));
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text().find("Address already in use"), std::string::npos);
}

}  // namespace
}  // namespace prism::transport
