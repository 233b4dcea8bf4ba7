// SPDX-License-Identifier: MIT
// Addresses of network lines: the error names the missing part.
#include "drivers/transport/endpoint.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/blocks.hpp"

namespace prism::transport {
namespace {

std::string read(const char* text) {
  const auto endpoint = parse_endpoint(text);
  return endpoint ? endpoint->host + " " + endpoint->port : endpoint.error();
}

TEST(Endpoint, HostAndPort) {
  for (const test::Block& row : test::blocks("transport/endpoint.txt", 2))
    EXPECT_EQ(read(row[0].c_str()), row[1]) << row.where;
  EXPECT_EQ(read(""), "is empty, expected HOST:PORT");
}

TEST(Endpoint, NumericWithOrWithoutAPort) {
  EXPECT_EQ(parse_numeric_endpoint("192.0.2.7").value(), (Endpoint{"192.0.2.7", ""}));
  EXPECT_EQ(parse_numeric_endpoint("192.0.2.7:4001").value(), (Endpoint{"192.0.2.7", "4001"}));
  EXPECT_EQ(parse_numeric_endpoint("::1").value(), (Endpoint{"::1", ""}));
  EXPECT_EQ(parse_numeric_endpoint("[::1]:4001").value(), (Endpoint{"::1", "4001"}));
  EXPECT_EQ(parse_numeric_endpoint("gyro").error(), "found \"gyro\", expected an IP address");
  EXPECT_EQ(parse_numeric_endpoint("gyro:4001").error(), "found \"gyro:4001\", expected an IP address");
}

}  // namespace
}  // namespace prism::transport
