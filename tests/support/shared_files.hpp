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

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace prism::test

/// Skips the running test where a file or folder of the shared data is not there.
#define PRISM_NEEDS_SHARED(relative)                                    \
  if (!std::filesystem::exists(prism::test::shared_dir() / (relative))) \
  GTEST_SKIP() << "no " << (prism::test::shared_dir() / (relative)) << "; set PRISM_SHARED to run this test"
