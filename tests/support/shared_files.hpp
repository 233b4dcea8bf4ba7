// SPDX-License-Identifier: MIT
// Finds reference data next to the source tree; tests are skipped with a message if it is missing.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace prism::test {

/// ../shared next to the source tree, or $PRISM_SHARED.
inline std::filesystem::path shared_dir() {
  if (const char* dir = std::getenv("PRISM_SHARED")) return dir;
  return std::filesystem::path(PRISM_SOURCE_DIR) / ".." / "shared";
}

/// The reference numbers `name`: from tests/golden if it has them, else from the shared data.
inline std::filesystem::path golden_dir(const std::string& name) {
  const auto here = std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "golden" / name;
  return std::filesystem::exists(here) ? here : shared_dir() / "golden" / name;
}

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace prism::test

/// Skips the running test if a file or directory of the shared data is missing; the end of the message is its group.
#define PRISM_NEEDS(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << (path).string() << " (../shared)"

#define PRISM_NEEDS_SHARED(relative) PRISM_NEEDS(prism::test::shared_dir() / (relative))
