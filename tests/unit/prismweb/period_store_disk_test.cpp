// SPDX-License-Identifier: MIT
// The store of minutes on a disk that is full.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismweb/period_store.hpp"

namespace prism::prismweb {
namespace {

// Earlier bug: a disk without a free inode was reported as "No such file or directory".
TEST(PeriodStoreDisk, AFileThatCannotBeCreatedHasTheDisksReason) {
  const test::TemporaryFolder folder;
  const std::string full = folder.file("full");
  for (const bool with_database : {false, true}) {  // no inode for the database, or none for its log
    std::filesystem::create_directory(full);
    if (::mount("tmpfs", full.c_str(), "tmpfs", 0, "size=1m,nr_inodes=2") != 0) GTEST_SKIP() << "needs root, to mount";
    if (!with_database) std::ofstream(full + "/other") << "text";
    const auto store = PeriodStore::open(full);
    const std::string reason = store ? "" : store.error().text();
    ::umount(full.c_str());
    EXPECT_EQ(reason, full + "/periods.sqlite: No space left on device") << with_database;
  }
}

}  // namespace
}  // namespace prism::prismweb
