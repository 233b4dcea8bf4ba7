// SPDX-License-Identifier: MIT
// The model file: a written model reads back as the same model, every error has its own complete message, and the id
// depends on every number of the model and on nothing else.
#include "compensation/model_text.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "compensation/polynomial_model.hpp"
#include "tests/support/blocks.hpp"
#include "tests/support/generated.hpp"
#include "tests/support/models.hpp"
#include "tests/support/schema_validator.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::compensation {
namespace {

using nlohmann::json;

std::string shipped_text() {
  return test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "config/models/tao2019-model1.json");
}

std::string refusal(const std::string& text) {
  const auto model = parse_model(text, "m.json");
  return model ? "" : model.error().text();
}

const PolynomialModel& polynomial(const ModelPtr& model) { return dynamic_cast<const PolynomialModel&>(*model); }

TEST(ModelText, EveryErrorHasItsOwnMessage) {
  ASSERT_EQ(refusal(shipped_text()), "");
  for (const test::Block& row : test::blocks("compensation/model_errors.txt", -2)) {
    json file = json::parse(shipped_text());
    for (std::size_t i = 0; i + 1 < row.lines.size(); ++i) {
      const std::size_t blank = std::min(row[i].find(' '), row[i].size());
      const json::json_pointer at(row[i].substr(0, blank));
      if (blank < row[i].size())
        file[at] = json::parse(row[i].substr(blank));
      else
        file.at(at.parent_pointer()).erase(at.back());
    }
    EXPECT_EQ(refusal(file.dump()), "m.json" + row.lines.back()) << row.where;
  }
}

// Version 0.3 needed more than a minute for a million terms.
TEST(ModelText, LimitsTheTermsOfAPolynomial) {
  const auto with_terms = [](std::size_t terms) {
    json file = json::parse(shipped_text());
    file["terms"] = json::array();
    for (std::size_t i = 0; i < terms; ++i) file["terms"].push_back({{"powers", {1, 0}}, {"coefficient", 0.001}});
    return refusal(file.dump());
  };
  EXPECT_EQ(with_terms(10'001), "m.json:/terms: found 10001, expected at most 10000");
  EXPECT_EQ(with_terms(10'000).find("terms"), std::string::npos);
}

// base/section_errors.txt has the other errors of JSON.
TEST(ModelText, RejectsWhatIsNoModel) {
  EXPECT_EQ(refusal("\nt,T,U,y\n0,20,5,1\n"), "m.json: found no JSON object, expected a model made by prismcal train");
  EXPECT_EQ(refusal("{}"), "m.json: \"format\" is missing");
  std::string text = shipped_text();
  text.replace(text.find("-0.917"), 6, "-1e309");
  EXPECT_EQ(refusal(text), "m.json: not valid JSON: number overflow parsing '-1e309'");
}

TEST(ModelText, RejectsEveryTruncatedFile) {
  const std::string text = shipped_text();
  for (std::size_t length = 0; length + 1 < text.size(); ++length) {
    const std::string line = refusal(text.substr(0, length));
    ASSERT_NE(line, "") << "cut at " << length;
    ASSERT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

// A changed byte either does not affect the numbers (a space, a name, the provenance) or is rejected: changed numbers
// are never used with the old id.
TEST(ModelText, DetectsEveryByteThatChangesTheNumbers) {
  std::mt19937 random(3);
  const std::string text = shipped_text();
  const ModelPtr original = *parse_model(text, "m.json");
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string changed = text;
    changed[random() % text.size()] = static_cast<char>(random());
    const auto model = parse_model(changed, "m.json");
    if (!model) {
      ++refused;
      continue;
    }
    ASSERT_EQ(polynomial(*model).terms(), polynomial(original).terms()) << changed;
    ASSERT_EQ((*model)->info().features, original->info().features) << changed;
    ASSERT_EQ((*model)->info().inputs, original->info().inputs) << changed;
    ASSERT_EQ((*model)->info().domain, original->info().domain) << changed;
  }
  EXPECT_GT(refused, 5'000);
}

TEST(ModelText, TheShippedFilesEqualTheOutputOfTheWriter) {
  for (const char* name : {"tao2019-model1.json", "tao2019-model2.json"}) {
    const std::string text = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "config/models" / name);
    const auto model = parse_model(text, name);
    ASSERT_TRUE(model) << model.error().text();
    json expected = json::parse(text), written = json::parse(format_model(**model));
    EXPECT_EQ(written, expected) << name;
  }
}

TEST(ModelText, RandomModelsReadBackToTheLastBit) {
  std::mt19937_64 random(5);
  const auto number = [&] {
    for (;;) {
      const double value = std::bit_cast<double>(random());
      if (std::isfinite(value)) return random() % 5 == 0 ? std::copysign(0.0, value) : value;
    }
  };
  for (int i = 0; i < 500; ++i) {
    ModelInfo info;
    info.kind = i % 2 ? "polynomial" : "stepwise";
    info.name = "model \"" + std::to_string(i) + "\" \\ \xc3\xa4";
    info.gyro_serial = i % 3 ? "70-\"0042\"" : "";
    info.features.length_s = 1 + static_cast<int>(random() % 3600);
    info.features.end_mean_s = 1 + static_cast<int>(random() % static_cast<unsigned>(info.features.length_s));
    info.features.max_gap_s = static_cast<int>(random() % 3601);
    info.features.slope = i % 4 ? SlopeMethod::kDifference : SlopeMethod::kLeastSquares;
    if (i % 3 == 1) info.features.sensors = {{"case", "degC"}};
    if (i % 3 == 1) info.features.response_s = 1 + static_cast<int>(random() % 1'000'000);
    info.inputs = {"U", "dTdt", "T"};
    if (i % 5) info.domain = {{-1e300, number(), -0.0}, {number(), 0, 0}};
    for (std::size_t k = 0; k < info.domain.min.size(); ++k) {
      if (info.domain.min[k] > info.domain.max[k]) std::swap(info.domain.min[k], info.domain.max[k]);
    }
    std::vector<Term> terms;
    for (unsigned t = 0; t < random() % 12; ++t) {
      terms.push_back({{static_cast<int>(random() % 10), 0, static_cast<int>(random() % 10)}, number()});
    }
    const PolynomialModel model(info, terms, i % 2 ? 0.00123 : kUnknown);
    const auto read = parse_model(format_model(model), "m.json");
    ASSERT_TRUE(read) << read.error().text() << "\n" << format_model(model);
    EXPECT_EQ((*read)->info().id, model.info().id);
    EXPECT_EQ(polynomial(*read).terms(), terms);
    EXPECT_EQ(std::isfinite(polynomial(*read).sd_deg_per_h()), i % 2 == 1);
    EXPECT_EQ(format_model(**read), format_model(model));
  }
}

TEST(ModelText, NameGyroAndProvenanceMayBeAbsentAndAreUnchanged) {
  json file = json::parse(shipped_text());
  file["provenance"] = {{"inputs", {{{"file", "a.csv"}, {"rows", 924}}}}, {"score", 0.00842}};
  const auto model = parse_model(file.dump(), "m.json");
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_EQ(json::parse((*model)->info().provenance_json), file["provenance"]);
  EXPECT_EQ(json::parse(format_model(**model))["provenance"], file["provenance"]);
  file.erase("name"), file.erase("gyro"), file.erase("provenance");
  const auto bare = parse_model(file.dump(), "m.json");
  ASSERT_TRUE(bare) << bare.error().text();
  EXPECT_EQ((*bare)->info().provenance_json, "{}");
  EXPECT_EQ((*bare)->info().gyro_serial, "");
  const ModelPtr fresh = test::linear_model({"T"}, {1});  // its provenance_json is empty: never set
  EXPECT_TRUE(parse_model(format_model(*fresh), "m.json"));
}

TEST(ModelText, ANameInInvalidUtf8IsWrittenWithReplacements) {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T"};
  info.name = "caf\xe9";
  const auto model = parse_model(format_model(PolynomialModel(info, {})), "m.json");
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_EQ((*model)->info().name, "caf\xef\xbf\xbd");
}

ModelInfo base_info() {
  ModelInfo info;
  info.kind = "polynomial";
  info.inputs = {"T", "U"};
  info.domain = {{-40, 5}, {70, 6}};
  return info;
}

const std::vector<Term> kTerms = {{{0, 0}, 1.5}, {{1, 0}, -0.25}};

std::string id_of(const ModelInfo& info, const std::vector<Term>& terms = kTerms, double sd = 0.001) {
  return PolynomialModel(info, terms, sd).info().id;
}

// formats_doc_test.cpp compares an id with the digest of its text.
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
      [](ModelInfo& i) { i.features.response_s = 900; },
      [](ModelInfo& i) { i.features.response_s = 901; },
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

using Json = test::SchemaValidator::Json;
const std::filesystem::path kSource = PRISM_SOURCE_DIR;

Json load(const std::filesystem::path& path) { return Json::parse(test::read_file(path)); }

TEST(ModelSchema, IsWrittenFromTheTable) {
  test::expect_generated("config/models/model.schema.json", test::schema_text(model_schema()));
}

TEST(ModelSchema, AcceptsTheShippedModelsAndRejectsDamagedOnes) {
  const test::SchemaValidator validator(load(kSource / "config/models/model.schema.json"));
  for (const char* name : {"tao2019-model1.json", "tao2019-model2.json"}) {
    const Json model = load(kSource / "config/models" / name);
    EXPECT_TRUE(validator.accepts(model)) << name;
    Json of_a_gyro = model;
    of_a_gyro["version"] = 2;
    of_a_gyro["gyro"]["serial"] = "70";
    EXPECT_TRUE(validator.accepts(of_a_gyro)) << name;
    for (const auto& [key, value] : model.items()) {
      Json damaged = model;
      damaged[key] = nullptr;
      EXPECT_FALSE(validator.accepts(damaged)) << name << " " << key;
    }
  }
}

}  // namespace
}  // namespace prism::compensation
