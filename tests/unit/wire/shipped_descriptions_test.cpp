// SPDX-License-Identifier: MIT
// Every description in config/frames loads, and decodes the test vectors it carries.
#include <gtest/gtest.h>

#include "tests/unit/wire/descriptions.hpp"

namespace prism {
namespace {

TEST(ShippedDescriptions, LoadAndDecodeTheirOwnTestVectors) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() != ".json" || entry.path().filename() == "frame.schema.json") continue;
    const auto parsed = parse_frame_description(test::read_file(entry.path()), entry.path().filename().string());
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ((*parsed)->name, entry.path().stem()) << "the file is named after the description";
    EXPECT_FALSE((*parsed)->source.empty()) << entry.path();
    const auto vectors = run_test_vectors(**parsed);
    EXPECT_TRUE(vectors) << vectors.error().text();
    ++count;
  }
  EXPECT_GE(count, 2);
}

TEST(ShippedDescriptions, AVectorWithAWrongValueIsRefusedWithItsPlace) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  const std::size_t at = text.find("\"counter\": 4660");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 15, "\"counter\": 4661");
  const auto result = run_test_vectors(*test::description_of(text));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text(), "test.json:/vectors/0: counter is 4660; expected 4661");
}

}  // namespace
}  // namespace prism
