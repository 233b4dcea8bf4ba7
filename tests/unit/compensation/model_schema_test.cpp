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
  for (const char* file : {"model_text", "polynomial_text", "kernel_text", "lssvm_text", "composite_text"}) {
    test::add_reader_keys(std::string("compensation/") + file + ".cpp", asked);
  }
  EXPECT_EQ(written, asked);
}

TEST(ModelSchema, AcceptsTheShippedModelsAndRejectsDamagedOnes) {
  const test::SchemaValidator validator(load(kSource / "config/models/model.schema.json"));
  for (const char* name : {"tao2019-model1.json", "tao2019-model2.json"}) {
    const Json model = load(kSource / "config/models" / name);
    EXPECT_TRUE(validator.accepts(model)) << name;
    for (const auto& [key, value] : model.items()) {
      Json damaged = model;
      damaged[key] = nullptr;
      EXPECT_FALSE(validator.accepts(damaged)) << name << " " << key;
    }
  }
}

}  // namespace
}  // namespace prism::compensation
