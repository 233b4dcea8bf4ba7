// SPDX-License-Identifier: MIT
#include "tools/prismweb/passwords.hpp"

#include <gtest/gtest.h>

namespace prism::prismweb {
namespace {

// Hash of the empty password: a test vector of Openwall's crypt_blowfish.
constexpr const char* kOpenwall = "$2y$05$CCCCCCCCCCCCCCCCCCCCC.7uG0VCzI2bS7j6ymqJi9CdcdxiRTWNy";

TEST(Passwords, AreComparedWithBcrypt) {
  EXPECT_TRUE(is_password("", kOpenwall));
  EXPECT_FALSE(is_password("x", kOpenwall));
  EXPECT_FALSE(is_password("", "")) << "an empty hash never matches";
  const auto hash = hash_password("a secret");
  ASSERT_TRUE(hash);
  EXPECT_TRUE(is_password("a secret", *hash));
  EXPECT_FALSE(is_password("a secret ", *hash));
  EXPECT_FALSE(is_password(std::string("a secret\0x", 10), *hash));
  EXPECT_NE(*hash_password("a secret"), *hash) << "each hash has its own salt";
  EXPECT_FALSE(hash_password(""));
  EXPECT_FALSE(hash_password(std::string(73, 'x')));
  EXPECT_FALSE(hash_password(std::string("a secret\0x", 10))) << "bcrypt would end at the NUL byte";
  const auto longest = hash_password(std::string(72, 'x'));
  ASSERT_TRUE(longest);
  EXPECT_TRUE(is_password(std::string(72, 'x'), *longest));
  EXPECT_FALSE(is_password(std::string(73, 'x'), *longest)) << "bcrypt reads 72 bytes";
}

TEST(Passwords, AreReadFromAFile) {
  const auto hashes = parse_passwords(std::string("# users\n\nlook:") + kOpenwall + "\r\nother:" + kOpenwall, "p");
  ASSERT_TRUE(hashes) << hashes.error().text();
  EXPECT_EQ(hashes->size(), 2U);
  EXPECT_EQ(hashes->at("look"), kOpenwall);
  for (const std::string& wrong : std::vector<std::string>{
           "", "# empty\n", "look", "look:", "look:secret", std::string(":") + kOpenwall, "look:{SHA}xyz",
           std::string("a:") + kOpenwall + "\na:" + kOpenwall, std::string("a:") + kOpenwall + "x"})
    EXPECT_FALSE(parse_passwords(wrong, "p")) << wrong;
  EXPECT_EQ(parse_passwords("\nlook:secret\n", "p").error().where, "p:2");
}

// These hashes match no password, or a comparison would take hours.
TEST(Passwords, InvalidHashesAreRejected) {
  const std::string good = kOpenwall;
  const auto with = [&](std::size_t at, const char* text) {
    return std::string(good).replace(at, std::string_view(text).size(), text);
  };
  for (const std::string& hash : {good, with(2, "b"), with(4, "15")})
    EXPECT_TRUE(parse_passwords("look:" + hash, "p")) << hash;
  for (const std::string& hash :
       {with(4, "03"), with(4, "16"), with(4, "31"), with(4, "5$"), with(2, "a"), with(6, "."), with(10, "!"),
        with(40, "="), with(28, "/"), with(59, "z"), good.substr(0, 59)})
    EXPECT_FALSE(parse_passwords("look:" + hash, "p")) << hash;
  EXPECT_EQ(
      parse_passwords("look:" + with(4, "31"), "p").error().what,
      "expected NAME:HASH with a bcrypt hash ($2b$ or $2y$) of cost 4 to 15; \"prismweb --hash-password\" writes one");
}

TEST(BasicFields, ContainNameAndPassword) {
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
