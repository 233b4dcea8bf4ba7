// SPDX-License-Identifier: MIT
// Every description in config/frames loads, and decodes the test vectors it carries.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

TEST(ShippedDescriptions, LoadAndDecodeTheirOwnTestVectors) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() != ".json" || entry.path().filename() == "frame.schema.json") continue;
    const auto parsed = parse_frame_description(test::read_file(entry.path()), entry.path().filename().string());
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ((*parsed)->name, entry.path().stem()) << "the file is named after the description";
    EXPECT_FALSE((*parsed)->source.empty()) << entry.path();
    EXPECT_FALSE((*parsed)->test_vectors.empty()) << entry.path();
    const auto vectors = run_test_vectors(**parsed);
    EXPECT_TRUE(vectors) << vectors.error().text();
    ++count;
  }
  EXPECT_GE(count, 24);
}

TEST(ShippedDescriptions, ReportAWrongValueOfAVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("\"counter\": 4660");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 15, "\"counter\": 4661");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(), "test.json:/vectors/0: counter is 4660; expected 4661");
}

TEST(ShippedDescriptions, RequireOneCompleteFramePerVector) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("00 07 63 4D");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 11, "00 07 63 4D A5");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(),
            "test.json:/vectors/0: 20 of 21 bytes are a frame; expected one frame of message type data");
}

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
