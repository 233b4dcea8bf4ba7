// SPDX-License-Identifier: MIT
// The rules for names, the escaping of hostile text for each output, and other functions of a text.
#include <gtest/gtest.h>

#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "tests/support/blocks.hpp"

namespace prism {
namespace {

const std::vector<std::string> kNames = {"baud", "data_bits", "parity", "stop_bits", "retry_min_s", "retry_max_s"};

using Text = const std::string&;
const std::map<std::string, std::function<std::string(Text)>> kFunctions = {
    {"csv_cell", [](Text text) { return csv_cell(text); }},
    {"printable", [](Text text) { return printable(text); }},
    {"printable_lines", [](Text text) { return printable_lines(text); }},
    {"shortened to 4", [](Text text) { return shortened(text, 4); }},
    {"html_text", [](Text text) { return html_text(text); }},
    {"shell_word", [](Text text) { return shell_word(text); }},
    {"json_text", [](Text text) { return json_text(nlohmann::json(text)); }},
    {"plain_text", [](Text text) { return plain_text(text); }},
    {"plain_text of 5", [](Text text) { return plain_text(text, 5); }},
    {"nearest_name", [](Text text) { return nearest_name(text, kNames); }},
    {"nearest_name of the other words",
     [](Text text) {
       std::istringstream words(text);
       const std::string name = *std::istream_iterator<std::string>(words);
       return nearest_name(name, std::vector<std::string>(std::istream_iterator<std::string>(words), {}));
     }},
    {"counted rows", [](Text text) { return counted(std::stoul(text), "row"); }},
    {"utc_text", [](Text text) { return utc_text(std::stoll(text)); }},
    {"utc_file_text", [](Text text) { return utc_file_text(std::stoll(text)); }},
    {"utc_nano_text", [](Text text) { return utc_nano_text(std::stoll(text)); }},
    {"parse_utc_file_text",
     [](Text text) {
       const auto second = parse_utc_file_text(text);
       return second ? std::to_string(*second) : "none";
     }},
    {"error of an axis name",
     [](Text text) { return check_text(TextRule::kAxisName, text, "a.csv:3").error().text(); }},
};

TEST(Texts, AreWrittenForTheirReaders) {
  for (const test::Block& block : test::blocks("base/texts.txt", -3)) {
    for (std::size_t i = 1; i + 1 < block.lines.size(); i += 2)
      EXPECT_EQ(kFunctions.at(block[0])(block.text(i)), block.text(i + 1)) << block.where << ": " << block[i];
  }
  EXPECT_EQ(plain_text(std::string(1000, 'x')).size(), 43u);
  EXPECT_EQ(nearest_name(std::string(100'000, 'b'), kNames), "");
  EXPECT_EQ(nearest_name("baud", {}), "");
  EXPECT_LT(check_text(TextRule::kText, std::string(1 << 20, '\n'), "a").error().text().size(), 500u);
}

TEST(OutsideText, FollowsItsRule) {
  const std::map<std::string, TextRule> rules = {{"axis", TextRule::kAxisName},       {"sensor", TextRule::kSensorName},
                                                 {"message", TextRule::kMessageName}, {"name", TextRule::kName},
                                                 {"text", TextRule::kText},           {"long", TextRule::kLongText}};
  for (const test::Block& block : test::blocks("base/names.txt", -2)) {
    const std::string rule = block[0].substr(0, block[0].find(' '));
    for (std::size_t i = 1; i < block.lines.size(); ++i)
      EXPECT_EQ(follows(rules.at(rule), block.text(i)), block[0] == rule + " accepts") << block.where << block[i];
  }
  for (const auto& [rule, longest] :
       {std::pair{TextRule::kName, 90}, {TextRule::kText, 128}, {TextRule::kLongText, 4096}}) {
    EXPECT_TRUE(follows(rule, std::string(static_cast<std::size_t>(longest), 'a')));
    EXPECT_FALSE(follows(rule, std::string(static_cast<std::size_t>(longest) + 1, 'a')));
  }
  EXPECT_TRUE(follows(TextRule::kText, ""));
}

}  // namespace
}  // namespace prism
