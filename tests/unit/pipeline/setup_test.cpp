// SPDX-License-Identifier: MIT
// A configuration and a frame description that do not fit together are refused.
#include "daemon/pipeline/setup.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/blocks.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

TEST(Setup, AcceptsOrRefusesAConfiguration) {
  for (const test::Block& block : test::blocks("pipeline/setups.txt", 2)) {
    const test::TemporaryFolder folder;
    std::ofstream(folder.file("g.json")) << block[0];
    const auto setup = load_setup(folder.file("g.json"));
    std::string found = setup ? "good" : setup.error().text();
    if (found.starts_with(folder.file(""))) found.erase(0, folder.file("").size());
    EXPECT_TRUE(found.ends_with(block[1])) << block.where << ": found " << found;
  }
}

}  // namespace
}  // namespace prism::pipeline
