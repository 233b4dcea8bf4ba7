// SPDX-License-Identifier: MIT
#include "tools/prismweb/passwords.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

// Of the empty password: a test vector of Openwall's crypt_blowfish.
constexpr const char* kOpenwall = "$2y$05$CCCCCCCCCCCCCCCCCCCCC.7uG0VCzI2bS7j6ymqJi9CdcdxiRTWNy";

TEST(Passwords, AreComparedByBcrypt) {
  EXPECT_TRUE(is_password("", kOpenwall));
  EXPECT_FALSE(is_password("x", kOpenwall));
  EXPECT_FALSE(is_password("", "")) << "no hash lets nobody in";
  const auto hash = hash_password("a secret");
  ASSERT_TRUE(hash);
  EXPECT_TRUE(is_password("a secret", *hash));
  EXPECT_FALSE(is_password("a secret ", *hash));
  EXPECT_FALSE(is_password(std::string("a secret\0x", 10), *hash));
  EXPECT_NE(*hash_password("a secret"), *hash) << "each has a salt of its own";
  EXPECT_FALSE(hash_password(""));
  EXPECT_FALSE(hash_password(std::string(73, 'x')));
}

TEST(Passwords, StandInAFileByName) {
  const auto hashes =
      parse_passwords(std::string("# who may look\n\nlook:") + kOpenwall + "\r\nother:" + kOpenwall, "p");
  ASSERT_TRUE(hashes) << hashes.error().text();
  EXPECT_EQ(hashes->size(), 2U);
  EXPECT_EQ(hashes->at("look"), kOpenwall);
  for (const std::string& wrong : std::vector<std::string>{
           "", "# none\n", "look", "look:", "look:secret", std::string(":") + kOpenwall, "look:{SHA}xyz",
           std::string("a:") + kOpenwall + "\na:" + kOpenwall, std::string("a:") + kOpenwall + "x"})
    EXPECT_FALSE(parse_passwords(wrong, "p")) << wrong;
  EXPECT_EQ(parse_passwords("\nlook:secret\n", "p").error().where, "p:2");
}

TEST(BasicFields, HaveNameAndPassword) {
  using Pair = std::pair<std::string, std::string>;
  EXPECT_EQ(basic_of("Basic bG9vazphIHNlY3JldA=="), Pair("look", "a secret"));
  EXPECT_EQ(basic_of("basic bG9vazo="), Pair("look", ""));
  EXPECT_EQ(basic_of("Basic bG9vazphOmI="), Pair("look", "a:b"));
  for (const char* field :
       {"", "Basic", "Basic ", "Basic !!!!", "Basic bG9vaw==", "Bearer bG9vazphIHNlY3JldA==", "Basic ===="})
    EXPECT_FALSE(basic_of(field)) << field;
  EXPECT_FALSE(basic_of("Basic " + std::string(5000, 'a')));
}

}  // namespace
}  // namespace prism::prismweb
