// SPDX-License-Identifier: MIT
#include "tools/prismweb/token_access.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "base/file.hpp"

namespace prism::prismweb {
namespace {

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
