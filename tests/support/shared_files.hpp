// SPDX-License-Identifier: MIT
// Finds the reference data that stands beside the project; tests skip with a message where it is missing.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace prism::test {

/// ../shared beside the source tree, or where PRISM_SHARED says.
inline std::filesystem::path shared_dir() {
  if (const char* dir = std::getenv("PRISM_SHARED")) return dir;
  return std::filesystem::path(PRISM_SOURCE_DIR) / ".." / "shared";
}

/// The reference numbers `name`: those that stand in the project (tests/golden), else those of the full set beside it.
inline std::filesystem::path golden_dir(const std::string& name) {
  const auto here = std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "golden" / name;
  return std::filesystem::exists(here) ? here : shared_dir() / "golden" / name;
}

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace prism::test

/// Skips the running test where a file or folder is not there; for what may stand beside the project, and only that.
#define PRISM_NEEDS(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << (path) << "; set PRISM_SHARED to run this test"

#define PRISM_NEEDS_SHARED(relative) PRISM_NEEDS(prism::test::shared_dir() / (relative))
