// SPDX-License-Identifier: MIT
#include "tools/prismweb/access.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "base/file.hpp"
#include "tools/prismweb/token_access.hpp"

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

struct TokenAccessTest : testing::Test {
  TokenAccessTest() {
    directory = testing::TempDir() + "prism-tokens." + std::to_string(::getpid());
    std::filesystem::create_directory(directory);
    ::setenv("RUNTIME_DIRECTORY", directory.c_str(), 1);
  }
  ~TokenAccessTest() override {
    ::unsetenv("RUNTIME_DIRECTORY");
    std::filesystem::remove_all(directory);
  }
  static std::unique_ptr<TokenAccess> open() { return std::move(*TokenAccess::open(8467)); }
  /// Opens the printed address; returns the cookie, "NAME=VALUE".
  static std::string begin(TokenAccess& access) {
    const auto field = access.begin_session(access.address_token());
    return field ? field->substr(0, field->find(';')) : "";
  }
  static Request with_cookie(const std::string& cookie) {
    Request request;
    request.host = "127.0.0.1:8467";
    request.cookie = "other=1; " + cookie;
    request.origin = "http://127.0.0.1:8467";
    return request;
  }
  std::string directory;
};

TEST_F(TokenAccessTest, TheAddressWorksOnceAndDiffersFromTheFile) {
  const auto access = open();
  const std::string token = access->address_token();
  EXPECT_NE(*read_text_file(directory + "/prismweb-8467.token"), token + "\n");
  EXPECT_FALSE(access->is_program_token(token)) << "the browser history must not contain the program token";
  EXPECT_FALSE(access->begin_session("x"));
  const auto field = access->begin_session(token);
  ASSERT_TRUE(field);
  EXPECT_EQ(field->substr(0, 11), "prism-8467=");
  EXPECT_EQ(field->substr(field->find(';')), "; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000");
  EXPECT_FALSE(access->begin_session(token)) << "a second browser";
  EXPECT_TRUE(access->renew_address_token());
  EXPECT_FALSE(access->renew_address_token()) << "not used yet";
  EXPECT_NE(access->address_token(), token);
}

TEST_F(TokenAccessTest, AcceptsACookieOnlyFromItsOwnPage) {
  const auto access = open();
  Request request = with_cookie(begin(*access));
  EXPECT_TRUE(access->is_authenticated(request));
  request.origin = "http://127.0.0.1:9999";  // a page of another server of this host: browsers send the cookie, too
  EXPECT_FALSE(access->is_authenticated(request));
  request.origin.clear();
  EXPECT_FALSE(access->is_authenticated(request)) << "unknown origin";
  for (const char* site : {"same-site", "cross-site"}) {
    request.sec_fetch_site = site;
    EXPECT_FALSE(access->is_authenticated(request)) << site;
  }
  request.sec_fetch_site = "same-origin";
  EXPECT_TRUE(access->is_authenticated(request));
  request.cookie.back() ^= 1;
  EXPECT_FALSE(access->is_authenticated(request));
}

TEST_F(TokenAccessTest, CookieAndProgramTokenSurviveARestart) {
  auto access = open();
  const std::string cookie = begin(*access), file = directory + "/prismweb-8467.token";
  access->renew_address_token();
  const std::string address = access->address_token(), token = *read_text_file(file);
  EXPECT_FALSE(access->is_program_token(cookie.substr(cookie.find('=') + 1))) << "a browser's cookie is not a token";
  access = open();
  EXPECT_TRUE(access->is_authenticated(with_cookie(cookie)));
  EXPECT_TRUE(access->is_program_token(token.substr(0, token.size() - 1)));
  EXPECT_FALSE(access->begin_session(address));
  ::chmod(file.c_str(), 0644);  // other users could read it
  access = open();
  EXPECT_FALSE(access->is_authenticated(with_cookie(cookie)));
  EXPECT_FALSE(access->is_program_token(token.substr(0, token.size() - 1)));
}

}  // namespace
}  // namespace prism::prismweb
