// SPDX-License-Identifier: MIT
// Simulates a bad disk (LD_PRELOAD). At each fdatasync(2) it reads the file named by PRISM_DISK: "eio" fails, "hang"
// blocks until the content changes; with other content, or without the file, the disk is good.
// PRISM_BAD_BLOCK=FILE:OFFSET: read(2) of FILE fails with EIO from that byte on, and blocks while the file named by
// PRISM_DISK contains "stall", like a file server that does not respond.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

bool says(const char* word) {
  const char* const path = std::getenv("PRISM_DISK");
  const int file = path != nullptr ? ::open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (file < 0) return false;
  char text[16] = {};
  const ssize_t size = ::syscall(SYS_read, file, text, sizeof text - 1);
  ::close(file);
  return size > 0 && std::strncmp(text, word, std::strlen(word)) == 0;
}

/// Returns true if `descriptor` is the file of PRISM_BAD_BLOCK; then `good` is the number of bytes from the current
/// position to the bad block.
bool has_bad_block(int descriptor, ssize_t& good) {
  const char* const setting = std::getenv("PRISM_BAD_BLOCK");
  const char* const colon = setting != nullptr ? std::strrchr(setting, ':') : nullptr;
  if (colon == nullptr) return false;
  char link[64], path[4096];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t size = ::readlink(link, path, sizeof path);
  if (size != colon - setting || std::strncmp(path, setting, static_cast<std::size_t>(size)) != 0) return false;
  good = std::atol(colon + 1) - ::lseek(descriptor, 0, SEEK_CUR);
  return true;
}

}  // namespace

extern "C" ssize_t read(int descriptor, void* at, std::size_t size) {
  ssize_t good = 0;
  if (has_bad_block(descriptor, good)) {
    while (says("stall")) ::usleep(50'000);
    if (good <= 0) {
      errno = EIO;
      return -1;
    }
    if (size > static_cast<std::size_t>(good)) size = static_cast<std::size_t>(good);
  }
  return ::syscall(SYS_read, descriptor, at, size);
}

extern "C" int fdatasync(int descriptor) {
  while (says("hang")) ::usleep(50'000);
  if (says("eio")) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fdatasync, descriptor));
}
