// SPDX-License-Identifier: MIT
// Files that are written from a table of keys: with PRISM_REGENERATE=1 a test writes them, else it compares.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/json_table.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::test {

/// `name`: of a file in the sources.
inline void expect_generated(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(PRISM_SOURCE_DIR) / name;
  if (std::getenv("PRISM_REGENERATE") != nullptr) std::ofstream(file) << text;
  EXPECT_TRUE(read_file(file) == text) << name << " differs: PRISM_REGENERATE=1 writes it";
}

/// The schema, and the keys in a man page from the end of the text `after` to the text `before`.
inline void expect_pages_of(const Json& schema, const std::string& schema_name, const std::string& page_name,
                            const std::string& after, const std::string& before) {
  expect_generated(schema_name, schema_text(schema));
  const std::string page = read_file(std::filesystem::path(PRISM_SOURCE_DIR) / page_name);
  const std::size_t begin = page.find(after) + after.size();
  expect_generated(page_name, page.substr(0, begin) + man_keys(schema) + page.substr(page.find(before, begin)));
}

}  // namespace prism::test
