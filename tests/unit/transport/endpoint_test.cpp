// SPDX-License-Identifier: MIT
// Addresses of network lines: the error names the missing part.
#include "drivers/transport/endpoint.hpp"

#include <gtest/gtest.h>

#include <string>

namespace prism::transport {
namespace {

std::string read(const char* text) {
  const auto endpoint = parse_endpoint(text);
  return endpoint ? endpoint->host + " " + endpoint->port : endpoint.error();
}

TEST(Endpoint, HostAndPort) {
  const std::pair<const char*, const char*> table[] = {
      {"device-server:4001", "device-server 4001"},
      {"192.0.2.7:1", "192.0.2.7 1"},
      {"[2001:db8::7]:65535", "2001:db8::7 65535"},
      {"[fe80::1%eth0]:4001", "fe80::1%eth0 4001"},
      {"", "is empty, expected HOST:PORT"},
      {"device-server", "found \"device-server\" without a port, expected HOST:PORT"},
      {"device-server:", "found \"device-server:\" without a port, expected HOST:PORT"},
      {":4001", "found \":4001\" without a host, expected HOST:PORT"},
      {"[]:4001", "found \"[]:4001\" without a host, expected HOST:PORT"},
      {"[::1]", "found \"[::1]\" without a port, expected HOST:PORT"},
      {"[::1]4001", "found \"[::1]4001\" without a port, expected HOST:PORT"},
      {"[::1:4001", "found \"[::1:4001\" without \"]\", expected [ADDRESS]:PORT"},
      {"::1:4001", "found \"::1:4001\", an IPv6 address without brackets; expected [ADDRESS]:PORT"},
      {"gyro:0", "found \"gyro:0\" with the port \"0\", expected 1 to 65535"},
      {"gyro:65536", "found \"gyro:65536\" with the port \"65536\", expected 1 to 65535"},
      {"gyro:telnet", "found \"gyro:telnet\" with the port \"telnet\", expected 1 to 65535"},
      {"gy ro:4001", "found \"gy ro:4001\" with the host \"gy ro\", expected a name or an address"},
  };
  for (const auto& [text, expected] : table) EXPECT_EQ(read(text), expected);
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
