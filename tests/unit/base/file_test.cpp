// SPDX-License-Identifier: MIT
// Files are replaced atomically, without leftovers; devices and pipes are rejected.
#include "base/file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "tests/support/full_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism {
namespace {

namespace fs = std::filesystem;

class File : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.file(name); }
  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path("")), fs::directory_iterator()); }
  mode_t mode(const std::string& name) const {
    struct stat status {};
    EXPECT_EQ(::stat(path(name).c_str(), &status), 0);
    return status.st_mode & 07777;
  }

  test::TemporaryFolder folder_;
};

TEST_F(File, ReadsBackWrittenText) {
  const std::string text("a\0b\r\n\xff", 6);
  ASSERT_TRUE(write_text_file(path("a"), text));
  EXPECT_EQ(*read_text_file(path("a")), text);
  ASSERT_TRUE(write_text_file(path("a"), ""));
  EXPECT_EQ(*read_text_file(path("a")), "");
  EXPECT_EQ(entries(), 1) << "no temporary file is left";
  EXPECT_NE(read_text_file("/proc/self/status")->find("Name:"), std::string::npos) << "a file without a size";
}

TEST_F(File, ReadsALongTextWithoutASize) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const Descriptor in(ends[0]);
  Descriptor out(ends[1]);
  ASSERT_GT(::fcntl(out.get(), F_SETPIPE_SZ, 1 << 18), 200'000);
  std::string text;
  while (text.size() < 200'000) text += std::to_string(text.size());
  ASSERT_TRUE(write_all(out.get(), text));
  out.reset();
  EXPECT_TRUE(*read_text(in, "pipe") == text);
}

TEST_F(File, KeepsTheOldFileOnAFullDisk) {
  const std::string old(1000, 'o');
  ASSERT_TRUE(write_text_file(path("a"), old));
  {
    const test::FullDisk disk(5000);
    const auto done = write_text_file(path("a"), std::string(10'000, 'n'));
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().text(), path("a") + ": cannot be written: File too large");
  }
  EXPECT_EQ(*read_text_file(path("a")), old);
  EXPECT_EQ(entries(), 1) << "no temporary file is left";
}

TEST_F(File, KeepsTheModeOfAnExistingFile) {
  ASSERT_TRUE(write_text_file(path("a"), "old and long"));
  ASSERT_EQ(::chmod(path("a").c_str(), 0640), 0);
  ASSERT_TRUE(write_text_file(path("a"), "new and long"));
  EXPECT_EQ(*read_text_file(path("a")), "new and long");
  EXPECT_EQ(mode("a"), 0640u);
  EXPECT_TRUE(write_all(open_output(path("a")).value().get(), "new"));
  EXPECT_EQ(*read_text_file(path("a")), "new");
  EXPECT_EQ(mode("a"), 0640u);
}

TEST_F(File, EmptiesAnOutputAndGivesANewOneTheUsualMode) {
  const mode_t mask = ::umask(0022);
  ASSERT_TRUE(write_text_file(path("a"), "old"));
  ASSERT_TRUE(write_text_file(path("exact"), "new", 0666));
  ASSERT_TRUE(open_output(path("a")) && open_output(path("b")) && open_output_stream(path("c")));
  ::umask(mask);
  EXPECT_EQ(fs::file_size(path("a")), 0u);
  for (const char* name : {"a", "b", "c"}) EXPECT_EQ(mode(name), 0644u) << name;
  EXPECT_EQ(mode("exact"), 0666u);
}

TEST_F(File, IsLockedByAnotherDescriptorOnly) {
  ASSERT_TRUE(write_text_file(path("a"), "text"));
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const Descriptor holder(::open(path("a").c_str(), O_RDONLY | O_CLOEXEC));
  EXPECT_FALSE(is_locked(path("a")));
  ASSERT_EQ(::flock(holder.get(), LOCK_EX), 0);
  EXPECT_TRUE(is_locked(path("a")));
  ASSERT_EQ(::flock(holder.get(), LOCK_SH), 0);
  EXPECT_FALSE(is_locked(path("a"))) << "a shared lock";
  EXPECT_FALSE(is_locked(path("pipe")));
  EXPECT_FALSE(is_locked(path("none")));
}

TEST_F(File, HasAnIdUntilItIsReplaced) {
  ASSERT_TRUE(write_text_file(path("a"), "text"));
  const auto id = FileId::of(path("a"));
  fs::create_hard_link(path("a"), path("same"));
  fs::create_symlink("a", path("link"));
  ASSERT_TRUE(id);
  EXPECT_EQ(FileId::of(path("same")), id);
  EXPECT_NE(FileId::of(path("link")), id);
  ASSERT_TRUE(write_text_file(path("a"), "other"));
  EXPECT_NE(FileId::of(path("a")), id);
  EXPECT_EQ(FileId::of(path("none")), std::nullopt);
}

// Without a writer open(2) of a pipe would wait forever.
TEST_F(File, RejectsLinksDevicesPipesAndDirectories) {
  ASSERT_TRUE(write_text_file(path("a"), "old"));
  fs::create_symlink("a", path("link"));
  fs::create_symlink("none", path("dangling"));
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  ASSERT_EQ(::mknod(path("socket").c_str(), S_IFSOCK | 0600, 0), 0);
  const auto read = [](const std::string& file) { return read_text_file(file).error().text(); };
  const auto follow = [](const std::string& file) { return FileReader::open(file).error().text(); };
  const auto write = [](const std::string& file) { return write_text_file(file, "new").error().text(); };
  const auto output = [](const std::string& file) { return open_output(file).error().text(); };
  const auto input_stream = [](const std::string& file) { return open_input_stream(file).error().text(); };
  const auto output_stream = [](const std::string& file) { return open_output_stream(file).error().text(); };
  const std::tuple<std::string, std::string, std::vector<std::string (*)(const std::string&)>> rows[] = {
      {path("link"), "is a symbolic link, expected a regular file", {write, output}},
      {path("dangling"), "is a symbolic link, expected a regular file", {write, output}},
      {"/dev/null", "is a device, expected a regular file", {write, output, read}},
      {path("socket"), "is a socket, expected a regular file", {write, output, read}},
      {path("pipe"), "is a pipe, expected a regular file", {write, read, follow}},
      {path(""), "is a directory, expected a regular file", {write, output, read}},
      {path("none"), "cannot be read: No such file or directory", {read, follow, input_stream}},
      {path("none/a"), "cannot be written: No such file or directory", {write, output, output_stream}},
  };
  for (const auto& [file, what, calls] : rows) {
    const std::string expected = Error{file, what}.text();
    for (const auto call : calls) EXPECT_EQ(call(file), expected);
  }
  for (const auto call : {+read, +write, +output})
    EXPECT_EQ(call(std::string("a\0b", 3)), "a\\x00b: contains a NUL byte, expected the path of a file");
  EXPECT_EQ(*read_text_file(path("link")), "old");
  EXPECT_FALSE(fs::exists(path("none")));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(File, LimitsTheSize) {
  ASSERT_TRUE(write_text_file(path("a"), std::string(2'000'000, 'a')));
  EXPECT_EQ(read_text_file(path("a"), 1 << 20).error().what, "is larger than 1 MiB, the limit for such a file");
  EXPECT_EQ(read_text_file(path("a"))->size(), 2'000'000u);
  EXPECT_EQ(read_text_file(path("a"), 2'000'000)->size(), 2'000'000u);
  EXPECT_FALSE(read_text_file(path("a"), 1'999'999));
  const std::size_t unknown = read_text_file("/proc/cpuinfo")->size();  // of files without a size
  EXPECT_TRUE(read_text_file("/proc/cpuinfo", 2 * unknown));
  EXPECT_EQ(read_text_file("/proc/cpuinfo", 10).error().what, "is larger than 0 MiB, the limit for such a file");
  fs::resize_file(path("a"), std::uintmax_t{1} << 40);  // sparse: 1 TiB
  EXPECT_EQ(read_text_file(path("a")).error().what, "is larger than 4 MiB, the limit for such a file");
}

// Lines, pieces (a large one is read without the buffer that lines use) and other places, in any order.
TEST_F(File, ReadsLinesAndPiecesAnywhere) {
  std::mt19937 random(1);
  std::string text = "one\n\n" + std::string(200'000, 'x') + "\n";
  while (text.size() < 1'000'000) text += std::string(random() % (random() % 9 ? 90 : 90'000), 'y') + "\n";
  text += "last";
  ASSERT_TRUE(write_text_file(path("a"), text));
  auto file = FileReader::open(path("a"));
  ASSERT_TRUE(file);
  std::size_t at = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto what = random() % 10;
    if (what == 0 || at == text.size()) {
      at = random() % (i % 3 == 0 ? text.size() : 10);
      file->seek(at);
    } else if (what < 3) {
      std::string piece(random() % (random() % 9 ? 100 : 250'000), '\0');
      const std::size_t size = file->read(piece);
      ASSERT_EQ(size, std::min(piece.size(), text.size() - at));
      ASSERT_EQ(piece.substr(0, size), text.substr(at, size));
      at += size;
    } else {
      std::string line;
      ASSERT_TRUE(file->read_line(line));
      const std::size_t end = text.find('\n', at);
      ASSERT_EQ(file->line_ended(), end != std::string::npos);
      ASSERT_EQ(line, text.substr(at, end - at));
      at = std::min(end, text.size() - 1) + 1;
    }
    ASSERT_EQ(file->offset(), at);
  }
  file->seek(text.size());
  std::string line(3, '\0');
  EXPECT_EQ(file->read(line), 0u);
  EXPECT_FALSE(file->read_line(line));
  EXPECT_TRUE(file->finish());
}

TEST_F(File, LimitsTheLengthOfALine) {
  ASSERT_TRUE(write_text_file(path("a"), "first\n" + std::string(kMaxLineBytes + 1, 'x') + "\n"));
  auto file = FileReader::open(path("a"));
  std::string line;
  EXPECT_TRUE(file->read_line(line));
  EXPECT_FALSE(file->read_line(line));
  EXPECT_EQ(file->finish().error().what, "has a line longer than 1048576 bytes");
}

// Address 0 of a process is not mapped: the kernel returns EIO, as a bad disk does.
TEST_F(File, ReportsAReadError) {
  const auto failing = read_text_file("/proc/self/mem");
  ASSERT_FALSE(failing);
  EXPECT_EQ(failing.error().text(), "/proc/self/mem: cannot be read: Input/output error");
  auto lines = FileReader::open("/proc/self/mem");
  ASSERT_TRUE(lines);
  std::string line;
  EXPECT_FALSE(lines->read_line(line));
  EXPECT_EQ(lines->finish().error().what, "cannot be read: Input/output error");
}

}  // namespace
}  // namespace prism
