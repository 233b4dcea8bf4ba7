// SPDX-License-Identifier: MIT
// SHA-256 against the examples that NIST published with FIPS 180-4.
#include "base/sha256.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace prism {
namespace {

// The last two are those of sha256sum of one zero byte, and of the byte 0xbd (the first of NIST's byte-oriented
// messages).
TEST(Sha256, MatchesTheExamplesOfTheStandard) {
  const std::pair<std::string, const char*> rows[] = {
      {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
      {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
      {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
       "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
      {"abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrsmnopqrstnopqrst"
       "u",
       "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1"},
      {std::string(1'000'000, 'a'), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"},
      {std::string(1, '\0'), "6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d"},
      {"\xbd", "68325720aabd7c82f30f554b313d0570c95accbb7dc4b5aae11204c08ffe732b"}};
  for (const auto& [text, sum] : rows) EXPECT_EQ(sha256_hex(text), sum);
}

}  // namespace
}  // namespace prism
