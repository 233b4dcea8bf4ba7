// SPDX-License-Identifier: MIT
// What the documents print in hex is what the descriptions decode.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "tests/unit/wire/descriptions.hpp"

namespace prism {
namespace {

std::string hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const auto byte : bytes) text += fmt::format("{}{:02X}", text.empty() ? "" : " ", byte);
  return text;
}

TEST(Documents, TheWorkedExamplesOfTheWirePageAreTestVectors) {
  const std::string page = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "wire.md");
  for (const char* name : {"trplg", "trplg-increment"}) {
    const auto description = test::shipped(name);
    ASSERT_FALSE(description->test_vectors.empty());
    EXPECT_NE(page.find("    " + hex(description->test_vectors[0].bytes) + "\n"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace prism
