// SPDX-License-Identifier: MIT
#include "config/socket_path.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/temporary_folder.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

TEST(SocketPlace, DetectsASocketThatWouldStartAnInstance) {
  const test::TemporaryFolder folder;
  const std::string socket = folder.file("gyro1.sock");
  EXPECT_FALSE(would_start(socket)) << "a prismd started by hand listens itself";
  fs::create_directory(folder.file("activated"));
  fs::create_symlink(socket, folder.file("activated/gyro1.sock"));
  EXPECT_TRUE(would_start(socket)) << "it was stopped, or not started yet";
  fs::create_directories(folder.file("running/gyro1"));
  EXPECT_FALSE(would_start(socket)) << "it is running";
  EXPECT_FALSE(would_start(folder.file("gyro2.sock")));
}

}  // namespace
}  // namespace prism::config
