// SPDX-License-Identifier: MIT
// model.schema.json (for editors) and the reader of model files have the same keys.
#include <gtest/gtest.h>

#include "tests/support/schema_keys.hpp"

namespace prism::compensation {
namespace {

using Json = test::SchemaValidator::Json;
const std::filesystem::path kSource = PRISM_SOURCE_DIR;

Json load(const std::filesystem::path& path) { return Json::parse(test::read_file(path)); }

TEST(ModelSchema, HasTheKeysOfTheReaderAndNoOthers) {
  std::set<std::string> written, asked;
  test::add_schema_keys(load(kSource / "config/models/model.schema.json"), written);
  for (const auto& entry : std::filesystem::directory_iterator(kSource / "compensation")) {
    const std::string file = entry.path().filename();
    if (file.ends_with("_text.cpp") && file != "compensated_text.cpp")
      test::add_reader_keys("compensation/" + file, asked);
  }
  EXPECT_EQ(written, asked);
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
