// SPDX-License-Identifier: MIT
// Model ids depend on every number of the model and on nothing else.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "compensation/model.hpp"
#include "compensation/model_text.hpp"
#include "compensation/polynomial_model.hpp"
#include "tests/support/models.hpp"

namespace prism::compensation {
namespace {

ModelInfo base_info() {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T", "U"};
  info.domain = {{-40, 5}, {70, 6}};
  info.features.lag_time_constants_s = {1500};
  return info;
}

const std::vector<Term> kTerms = {{{0, 0}, 1.5}, {{1, 0}, -0.25}};

std::string id_of(const ModelInfo& info, const std::vector<Term>& terms = kTerms, double sd = 0.001) {
  return PolynomialModel(info, terms, sd).info().id;
}

TEST(ModelId, DependsOnTheNumbersNotOnTheNames) {
  ModelInfo other = base_info();
  other.name = "another name";
  other.provenance_json = R"({"by": "operator"})";
  other.id = "what stood here before";
  EXPECT_EQ(id_of(other), id_of(base_info()));
  EXPECT_EQ(id_of(base_info()).size(), 64u);
}

// A model protects one gyro: its serial number must not be changed in the file. Version 1 did not notice it.
TEST(ModelId, DependsOnTheSerialNumberSinceVersion2) {
  ModelInfo bound = base_info();
  bound.gyro_serial = "70-0042";
  bound.gyro_axis = "x";
  EXPECT_EQ(model_version(bound), 2);
  const std::string text = format_model(PolynomialModel(bound, kTerms, 0.001));
  EXPECT_TRUE(parse_model(text, "m.json"));
  for (const auto& [from, to] :
       {std::pair("70-0042", "70-0043"), std::pair("70-0042", ""), std::pair("\"axis\": \"x\"", "\"axis\": \"y\""),
        std::pair("\"version\": 2", "\"version\": 1")}) {
    std::string changed = text;
    changed.replace(changed.find(from), std::string(from).size(), to);
    const auto model = parse_model(changed, "m.json");
    ASSERT_FALSE(model) << to;
    EXPECT_NE(model.error().text().find("it was changed or damaged"), std::string::npos) << model.error().text();
  }
  ModelInfo old = bound;
  old.id_has_serial = false;
  EXPECT_EQ(id_of(old), id_of(base_info()));
  const std::string old_text = format_model(PolynomialModel(old, kTerms, 0.001));
  EXPECT_NE(old_text.find("\"version\": 1"), std::string::npos);
  EXPECT_TRUE(parse_model(old_text, "m.json"));
}

TEST(ModelId, ChangesWithEveryNumber) {
  const std::vector<std::string> swapped = {"U", "T"};
  const std::function<void(ModelInfo&)> changes[] = {
      [](ModelInfo& i) { i.kind = "stepwise"; },
      [&](ModelInfo& i) { i.inputs = swapped; },
      [](ModelInfo& i) { i.features.length_s = 99; },
      [](ModelInfo& i) { i.features.slope = SlopeMethod::kLeastSquares; },
      [](ModelInfo& i) { i.features.end_mean_s = 9; },
      [](ModelInfo& i) { i.features.max_gap_s = 4; },
      [](ModelInfo& i) { i.features.lag_time_constants_s = {1500.0000000000002}; },
      [](ModelInfo& i) { i.features.lag_time_constants_s = {}; },
      [](ModelInfo& i) { i.domain.min[0] = -40.000000000000007; },
      [](ModelInfo& i) { i.domain.max[1] = 6.0000000000000009; },
      [](ModelInfo& i) { i.domain = {}; },
  };
  std::set<std::string> ids = {id_of(base_info())};
  for (const auto& change : changes) {
    ModelInfo info = base_info();
    change(info);
    ids.insert(id_of(info));
  }
  ids.insert(id_of(base_info(), {{{0, 0}, 1.5}, {{0, 1}, -0.25}}));
  ids.insert(id_of(base_info(), {{{0, 0}, 1.5000000000000002}, {{1, 0}, -0.25}}));
  ids.insert(id_of(base_info(), {{{0, 0}, 1.5}}));
  ids.insert(id_of(base_info(), kTerms, 0.0010000000000000002));
  ids.insert(id_of(base_info(), kTerms, kUnknown));
  EXPECT_EQ(ids.size(), 1 + std::size(changes) + 5);
}

// The id is stored in files and logs that outlive this build; sha256sum of the text in the comment returns the same:
//   printf 'prism-model 1 polynomial\n100 difference 10 5 []\nT\n[] []\n\n0 1.5\n1 -0.25'
TEST(ModelId, EqualsTheDigestOfSha256sum) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  EXPECT_EQ(id_of(info, {{{0}, 1.5}, {{1}, -0.25}}, kUnknown),
            "46376c95ae861d40207de889e76c7a0769aa50fac391df9ab0c9be015592b493");
}

TEST(ExactText, ReadsBackAsTheSameDoubleAlsoThroughJson) {
  std::mt19937_64 random(11);
  std::vector<double> values;
  for (const char* text : {"0", "-0", "1", "-1", "0.1", "1e15", "9007199254740994", "1e16", "1e17",
                           "123456789012345680", "1e-5", "1e22", "5e-324", "1.7976931348623157e308",
                           "-1.7976931348623157e308", "2.2250738585072014e-308", "4.35", "1.7976931348623155e308"})
    values.push_back(std::strtod(text, nullptr));
  while (values.size() < 100'000) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) values.push_back(value);
    values.push_back(std::round(1e17 * static_cast<double>(random()) / 1.8e19));
  }
  for (const double value : values) {
    const std::string text = exact_text(value);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(std::strtod(text.c_str(), nullptr)), std::bit_cast<std::uint64_t>(value))
        << text;
    const double read = nlohmann::json::parse(text).get<double>();
    ASSERT_EQ(std::bit_cast<std::uint64_t>(read), std::bit_cast<std::uint64_t>(value)) << text;
    ASSERT_LE(text.size(), 24u) << text;
  }
}

TEST(ExactText, ListsAreJsonArrays) {
  EXPECT_EQ(exact_texts(std::vector<double>{}), "[]");
  EXPECT_EQ(exact_texts(std::vector<double>{1, -2.5, 1e-7, -0.0}), "[1, -2.5, 1e-07, -0.0]");
}

}  // namespace
}  // namespace prism::compensation
