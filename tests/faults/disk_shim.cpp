// SPDX-License-Identifier: MIT
// Laid before libc by LD_PRELOAD: fdatasync(2) as a disk does it that fails or hangs. The file that PRISM_DISK names
// says what happens, at each call: "eio" fails, "hang" waits until it says something else; anything else, or no file,
// is a good disk.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace {

bool says(const char* word) {
  const char* const path = std::getenv("PRISM_DISK");
  const int file = path != nullptr ? ::open(path, O_RDONLY | O_CLOEXEC) : -1;
  if (file < 0) return false;
  char text[16] = {};
  const ssize_t size = ::read(file, text, sizeof text - 1);
  ::close(file);
  return size > 0 && std::strncmp(text, word, std::strlen(word)) == 0;
}

}  // namespace

extern "C" int fdatasync(int descriptor) {
  while (says("hang")) ::usleep(50'000);
  if (says("eio")) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_fdatasync, descriptor));
}
