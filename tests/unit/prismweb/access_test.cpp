// SPDX-License-Identifier: MIT
#include "tools/prismweb/access.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "base/file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::prismweb {
namespace {

Request request_to(const std::string& host, const std::string& origin = "") {
  Request request;
  request.host = host;
  request.origin = origin;
  return request;
}

class AccessTest : public testing::Test {
 protected:
  void SetUp() override { ::setenv("RUNTIME_DIRECTORY", folder_.file("").c_str(), 1); }
  void TearDown() override { ::unsetenv("RUNTIME_DIRECTORY"); }

  static Access open(const std::string& address = "127.0.0.1") {
    return *Access::with_token({"Lab.Example"}, address, 8467);
  }
  static Request with_token(const std::string& token) {
    Request request = request_to("127.0.0.1:8467", "http://127.0.0.1:8467");
    request.authorization = "Bearer " + token;
    return request;
  }
  /// A request of the page, after it opened the printed address.
  static Request of_page(Access& access) {
    const auto field = access.begin_session(with_token(access.address_token()));
    Request request = request_to("127.0.0.1:8467", "http://127.0.0.1:8467");
    request.cookie = "other=1; x" + field->substr(0, field->find('=')) + "=y; " + field->substr(0, field->find(';'));
    return request;
  }
  static bool is_known(const Access& access, const Request& request) {
    return access.admit(request, false).is_authenticated;
  }
  std::string file() const { return folder_.file("prismweb-8467.token"); }

  test::TemporaryFolder folder_;
};

TEST_F(AccessTest, AllowsThisHostAndConfiguredNames) {
  const Access access = open("::2");
  for (const char* host : {"localhost", "localhost:8467", "127.0.0.1:1", "[::1]:8467", "[::1]", "LOCALHOST:80",
                           "localhost.", "[::2]:443", "lab.example", "lab.example.:8467"})
    EXPECT_EQ(access.admit(request_to(host), false).status, 0) << host;
}

// DNS rebinding: a page of evil.example, resolved to 127.0.0.1, sends its own name.
TEST_F(AccessTest, RejectsOtherNames) {
  const Access access = open();
  for (const char* host :
       {"", "evil.example", "evil.example:8467", "localhost.evil.example", "localhost:8467@evil.example",
        "127.0.0.1.evil.example", "localhost:x", "localhost:12345678", "[::1", "[::1]x", "::1", "localhost:80 "})
    EXPECT_EQ(access.admit(request_to(host), false).status, 421) << host;
}

TEST_F(AccessTest, ChecksTheHostOfAnOrigin) {
  const Access access = open();
  const auto status = [&](const char* origin) { return access.admit(request_to("localhost", origin), false).status; };
  for (const char* origin : {"", "http://localhost:8467", "https://127.0.0.1"}) EXPECT_EQ(status(origin), 0) << origin;
  for (const char* origin : {"null", "http://evil.example", "http://evil.example:8467", "file://localhost", "localhost",
                             "http://", "http://localhost/path", "http://localhost@evil.example"})
    EXPECT_EQ(status(origin), 403) << origin;
}

TEST_F(AccessTest, TheApiNeedsTheTokenOfTheFile) {
  const Access access = open();
  const std::string token = read_text_file(file())->substr(0, 64);
  EXPECT_EQ(access.admit(with_token(token), true).status, 0);
  for (std::string wrong : {std::string(), token.substr(1), token + "0", access.address_token()})
    EXPECT_EQ(access.admit(with_token(wrong), true).status, 401) << wrong;
  Request request = with_token(token);
  for (const char* const scheme : {"bearer ", "Basic ", "Bearer", ""}) {
    request.authorization = scheme + token;
    EXPECT_EQ(access.admit(request, true).status, std::string(scheme) == "bearer " ? 0 : 401) << scheme;
  }
}

TEST_F(AccessTest, AUnixSocketNeedsNoToken) {
  const Access access({});
  EXPECT_EQ(access.admit(request_to("localhost"), true).status, 0);
  EXPECT_EQ(access.admit(request_to("evil.example"), true).status, 421);
  EXPECT_TRUE(access.is_program_token(""));
}

TEST_F(AccessTest, TheAddressWorksOnceAndDiffersFromTheFile) {
  Access access = open();
  const std::string token = access.address_token();
  EXPECT_NE(*read_text_file(file()), token + "\n") << "the browser history must not contain the program token";
  EXPECT_FALSE(access.begin_session(with_token("x")));
  const auto field = access.begin_session(with_token(token));
  ASSERT_TRUE(field);
  EXPECT_EQ(field->substr(0, 11), "prism-8467=");
  EXPECT_EQ(field->substr(field->find(';')), "; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000");
  EXPECT_FALSE(access.begin_session(with_token(token))) << "a second browser";
  EXPECT_FALSE(access.begin_session(with_token(""))) << "an empty secret never matches";
  EXPECT_TRUE(access.renew_address_token());
  EXPECT_FALSE(access.renew_address_token()) << "not used yet";
  EXPECT_NE(access.address_token(), token);
}

// Browsers also send the cookie with requests of a page of another server on this host.
TEST_F(AccessTest, AcceptsACookieOnlyFromItsOwnPage) {
  Access access = open();
  const Request own = of_page(access);
  struct Case {
    const char *origin, *site;
    bool is_known;
  };
  for (const auto& [origin, site, expected] : {Case{"http://127.0.0.1:8467", "", true},
                                               {"http://127.0.0.1:8467", "same-origin", true},
                                               {"", "none", true},
                                               {"", "same-origin", true},
                                               {"", "", false},
                                               {"", "same-site", false},
                                               {"", "cross-site", false},
                                               {"http://127.0.0.1:9999", "", false},
                                               {"http://127.0.0.1:9999", "same-site", false},
                                               {"https://127.0.0.1:8467", "", false},
                                               {"null", "", false}}) {
    Request request = own;
    request.origin = origin;
    request.sec_fetch_site = site;
    EXPECT_EQ(is_known(access, request), expected) << origin << " " << site;
  }
  Request wrong = own;
  wrong.cookie.back() ^= 1;
  EXPECT_FALSE(is_known(access, wrong));
}

TEST_F(AccessTest, CookieAndProgramTokenSurviveARestart) {
  Access access = open();
  const Request page = of_page(access);
  access.renew_address_token();
  const std::string address = access.address_token(), token = read_text_file(file())->substr(0, 64);
  EXPECT_FALSE(access.is_program_token(page.cookie.substr(page.cookie.rfind('=') + 1))) << "a cookie is not a token";
  access = open();
  EXPECT_TRUE(is_known(access, page));
  EXPECT_TRUE(access.is_program_token(token));
  EXPECT_FALSE(access.begin_session(with_token(address)));
  ::chmod(file().c_str(), 0644);  // other users could read it
  access = open();
  EXPECT_FALSE(is_known(access, page));
  EXPECT_FALSE(access.is_program_token(token));
}

}  // namespace
}  // namespace prism::prismweb
