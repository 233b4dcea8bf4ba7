// SPDX-License-Identifier: MIT
#include "tools/prismweb/access.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

TEST(HostList, AllowsThisHostAndConfiguredNames) {
  const HostList hosts("192.0.2.7", {"Lab.Example"});
  for (const char* host : {"localhost", "localhost:8467", "127.0.0.1:1", "[::1]:8467", "[::1]", "LOCALHOST:80",
                           "localhost.", "192.0.2.7:443", "lab.example", "lab.example.:8467"})
    EXPECT_TRUE(hosts.allows_host(host)) << host;
}

// DNS rebinding: a page of evil.example, resolved to 127.0.0.1, sends its own name.
TEST(HostList, RejectsOtherNames) {
  const HostList hosts("127.0.0.1", {});
  for (const char* host : {"", "evil.example", "evil.example:8467", "localhost.evil.example",
                           "localhost:8467@evil.example", "127.0.0.1.evil.example", "localhost:x", "localhost:12345678",
                           "[::1", "[::1]x", "::1", "lab.example", "localhost:80 "})
    EXPECT_FALSE(hosts.allows_host(host)) << host;
}

TEST(HostList, ChecksTheHostOfAnOrigin) {
  const HostList hosts("127.0.0.1", {});
  EXPECT_TRUE(hosts.allows_origin("")) << "not sent by a page";
  EXPECT_TRUE(hosts.allows_origin("http://localhost:8467"));
  EXPECT_TRUE(hosts.allows_origin("https://127.0.0.1"));
  for (const char* origin : {"null", "http://evil.example", "http://evil.example:8467", "file://localhost", "localhost",
                             "http://", "http://localhost/path", "http://localhost@evil.example"})
    EXPECT_FALSE(hosts.allows_origin(origin)) << origin;
}

TEST(Secrets, MatchOnlyIfEqual) {
  EXPECT_TRUE(is_secret("abc", "abc"));
  for (const char* given : {"", "ab", "abcd", "abd", "ABC"}) EXPECT_FALSE(is_secret(given, "abc")) << given;
  EXPECT_FALSE(is_secret("", "")) << "an empty secret never matches";
}

TEST(Secrets, TokensAreLongAndUnique) {
  const std::string one = make_token(), other = make_token();
  EXPECT_EQ(one.size(), 64U);
  EXPECT_NE(one, other);
}

TEST(Cookies, AreFoundByTheirFullName) {
  using Values = std::vector<std::string_view>;
  EXPECT_EQ(cookie_values("a=1; prism-8467=x; xprism-8467=y; prism-84670=z;prism-8467=w", "prism-8467"),
            Values({"x", "w"}));
  for (const char* field : {"", ";", "prism-8467", "=", "a=prism-8467=x"})
    EXPECT_EQ(cookie_values(field, "prism-8467"), Values()) << field;
}

TEST(Pages, AreOwnByOriginAndPort) {
  EXPECT_TRUE(is_own_page("http://localhost:8467", "same-origin", "localhost:8467"));
  EXPECT_TRUE(is_own_page("http://localhost:8467", "", "LOCALHOST:8467")) << "an older browser";
  EXPECT_TRUE(is_own_page("", "none", "localhost:8467")) << "the address was typed";
  EXPECT_FALSE(is_own_page("", "", "localhost:8467"));
  EXPECT_FALSE(is_own_page("http://localhost:9999", "same-site", "localhost:8467"));
  EXPECT_FALSE(is_own_page("http://localhost:9999", "", "localhost:8467"));
  EXPECT_FALSE(is_own_page("https://localhost:8467", "", "localhost:8467"));
  EXPECT_FALSE(is_own_page("null", "", "localhost:8467"));
}

TEST(Bearer, IsReadOnlyFromItsScheme) {
  EXPECT_EQ(bearer_of("Bearer abc"), "abc");
  EXPECT_EQ(bearer_of("bearer abc"), "abc");
  for (const char* field : {"", "Bearer", "Bearer ", "Basic abc", "abc"}) EXPECT_EQ(bearer_of(field), "") << field;
}

TEST(Addresses, AreLoopbackOnlyOnThisHost) {
  for (const char* address : {"127.0.0.1", "127.9.9.9", "::1"}) EXPECT_TRUE(*is_loopback(address)) << address;
  for (const char* address : {"0.0.0.0", "::", "192.0.2.7"}) EXPECT_FALSE(*is_loopback(address)) << address;
  EXPECT_FALSE(is_loopback("localhost").has_value());
}

}  // namespace
}  // namespace prism::prismweb
