// SPDX-License-Identifier: MIT
// The descriptions decode the hex examples of the documents.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

std::string hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const auto byte : bytes) text += fmt::format("{}{:02X}", text.empty() ? "" : " ", byte);
  return text;
}

TEST(Documents, WirePageShowsTheTestVectors) {
  const std::string page = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "wire.md");
  for (const char* name : {"trplg", "trplg-increment"}) {
    const auto description = test::shipped(name);
    ASSERT_FALSE(description->test_vectors.empty());
    EXPECT_NE(page.find("    " + hex(description->test_vectors[0].bytes) + "\n"), std::string::npos) << name;
  }
}

std::string frames_page() { return test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "frames.md"); }

/// The example JSON in docs/frames.md.
std::string course_description() {
  const std::string page = frames_page();
  const std::size_t begin = page.find("```json\n") + 8;
  return page.substr(begin, page.find("```\n", begin) - begin);
}

TEST(Documents, FramesPageExampleDecodesItsVector) {
  const auto description = test::description_of(course_description());
  ASSERT_EQ(description->test_vectors.size(), 1u);
  const auto proved = run_test_vectors(*description);
  EXPECT_TRUE(proved) << proved.error().text();
}

/// The reader's error for the example after one change.
std::string course_refusal(const std::string& from, const std::string& to) {
  std::string text = course_description();
  text.replace(text.find(from), from.size(), to);
  const auto parsed = parse_frame_description(text, "ex-1.json");
  if (!parsed) return parsed.error().text();
  const auto proved = run_test_vectors(**parsed);
  return proved ? "accepted" : proved.error().text();
}

TEST(Documents, FramesPageShowsTheReadersErrors) {
  const std::string page = frames_page();
  for (const auto& [from, to] : {std::pair{"\"at\": 4, \"type\": \"u8\"", "\"at\": 4, \"type\": \"u16\""},
                                 std::pair{"\"rate_hz\": 100", "\"rate_hz\": 2000"},
                                 std::pair{"FF DF 07 2A 98 01 01 41", "FF DF 06 2A 98 01 01 23"}}) {
    EXPECT_NE(page.find("    " + course_refusal(from, to) + "\n"), std::string::npos) << course_refusal(from, to);
  }
}

TEST(Documents, EveryShippedDescriptionIsListed) {
  const std::string page = frames_page();
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().stem() == "frame.schema") continue;
    EXPECT_NE(page.find("`" + entry.path().stem().string() + "`"), std::string::npos) << entry.path().stem();
  }
}

}  // namespace
}  // namespace prism::wire
