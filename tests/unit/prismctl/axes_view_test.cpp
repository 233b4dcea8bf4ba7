// SPDX-License-Identifier: MIT
// Results of one axis are shown without its name, as version 0.2 showed them.
#include "tools/prismctl/axes_view.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace prism::prismctl {
namespace {

using nlohmann::json;

TEST(OnlyAxis, IsPartOfTheResult) {
  const json status = json::parse(R"({"state": "receiving", "log": {"rows": 5},
    "axes": {"z": {"quality": "good", "log": {"followers": {"relay": {}}}}}})");
  EXPECT_EQ(with_only_axis(status), json::parse(R"({"state": "receiving", "axis": "z", "quality": "good",
    "log": {"rows": 5, "followers": {"relay": {}}}})"));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": {"quality": "good"}}})")), json({{"quality", "good"}}));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": [1, 2]}})")), json({1, 2}));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": null}})")), json());
}

TEST(OnlyAxis, LeavesOtherResults) {
  for (const char* text : {R"({"axes": {"x": {"a": 1}, "y": {"a": 2}}})", R"({"axes": ["z"]})", R"({"axes": {}})",
                           R"({"name": "prismd"})", "null", "[1]", "3"})
    EXPECT_EQ(with_only_axis(json::parse(text)), json::parse(text)) << text;
}

TEST(EachAxis, IsNamedIfThereAreSeveral) {
  const auto view = [](const json& own) { return own.dump() + "\n"; };
  EXPECT_EQ(each_axis(json::parse(R"({"axes": {"z": 1}})"), view), "1\n");
  EXPECT_EQ(each_axis(json::parse(R"({"axes": {"x": 1, "y": null}})"), view), "axis x\n1\n\naxis y\nnull\n");
}

}  // namespace
}  // namespace prism::prismctl
