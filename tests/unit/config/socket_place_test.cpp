// SPDX-License-Identifier: MIT
#include "config/socket_place.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/temporary_folder.hpp"

namespace prism::config {
namespace {

namespace fs = std::filesystem;

TEST(SocketPlace, DetectsASocketThatWouldStartAnInstance) {
  const test::TemporaryFolder folder;
  const std::string socket = folder.file("gyro1.sock");
  EXPECT_FALSE(would_start(socket)) << "a prismd that was started by hand listens there itself";
  fs::create_directory(folder.file("activated"));
  fs::create_symlink(socket, folder.file("activated/gyro1.sock"));
  EXPECT_TRUE(would_start(socket)) << "somebody stopped it, or nobody asked yet";
  fs::create_directories(folder.file("running/gyro1"));
  EXPECT_FALSE(would_start(socket)) << "it runs";
  EXPECT_FALSE(would_start(folder.file("gyro2.sock")));
}

}  // namespace
}  // namespace prism::config
