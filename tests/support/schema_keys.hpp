// SPDX-License-Identifier: MIT
// Keys of a schema, and keys that the strict reader uses (from its source): they must be equal.
#pragma once

#include <regex>
#include <set>
#include <string>

#include "tests/support/schema_validator.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::test {

/// Every name in a "properties" of the schema.
inline void add_schema_keys(const SchemaValidator::Json& schema, std::set<std::string>& keys) {
  if (!schema.is_object() && !schema.is_array()) return;
  for (const auto& [name, below] : schema.items()) {
    if (schema.is_object() && name == "properties") {
      for (const auto& [key, member] : below.items()) keys.insert(key);
    }
    add_schema_keys(below, keys);
  }
}

/// Every key that a source file asks a Section for: section.number("key", …) and its like.
inline void add_reader_keys(const std::string& source, std::set<std::string>& keys) {
  const std::string text = read_file(std::filesystem::path(PRISM_SOURCE_DIR) / source);
  const std::regex ask(
      R"re((?:\.(?:number|integer|boolean|text|raw_text|numbers|texts|choice|object|objects|any)\(\s*|section, )"([A-Za-z0-9_$]+)")re");
  for (std::sregex_iterator at(text.begin(), text.end(), ask), end; at != end; ++at) keys.insert((*at)[1]);
}

}  // namespace prism::test
