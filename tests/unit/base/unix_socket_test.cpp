// SPDX-License-Identifier: MIT
#include "base/unix_socket.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace prism {
namespace {

TEST(UnixSocket, ReplacesALeftoverAndSetsItsMode) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("s");
  listen_unix(path, 0600)->reset();  // without a listener
  const auto socket = listen_unix(path, 0640);
  ASSERT_TRUE(socket) << socket.error().text();
  struct stat info {};
  ASSERT_EQ(::stat(path.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777U, 0640U);
}

TEST(UnixSocket, RejectsAUsedOrInvalidPath) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("s"), plain = folder.file("plain"), absent = folder.file("no/s");
  const auto socket = listen_unix(path, 0600);
  ASSERT_TRUE(socket);
  std::ofstream(plain) << "text";
  const auto refusal = [](const std::string& where) { return listen_unix(where, 0600).error().text(); };
  EXPECT_EQ(refusal(path), path + ": another process listens there; expected a free path");
  EXPECT_EQ(refusal(plain), plain + ": exists but is not a socket; expected a free path");
  EXPECT_EQ(refusal(absent), absent + ": cannot be created: No such file or directory");
  const std::string longest(200, 'x');
  EXPECT_EQ(refusal(longest), longest + ": has 200 bytes, expected at most 107");
}

TEST(UnixSocket, RemovesOnlyItsOwnFile) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("s");
  {
    const auto socket = listen_unix(path, 0600);
    const OwnSocketFile own(path);
  }
  EXPECT_NE(::access(path.c_str(), F_OK), 0);
  const auto first = listen_unix(path, 0600);
  const auto second = [&] {
    const OwnSocketFile own(path);
    ::rename(path.c_str(), folder.file("moved").c_str());
    return listen_unix(path, 0600);  // of another program, at the same path
  }();
  EXPECT_EQ(::access(path.c_str(), F_OK), 0);
}

}  // namespace
}  // namespace prism
