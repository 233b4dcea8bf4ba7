// SPDX-License-Identifier: MIT
// Functions defined in the program replace those of libc, for prism and for libstdc++.
#include "tests/unit/log/failing_calls.hpp"

#include <dirent.h>
#include <dlfcn.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace {

bool is_regular(int descriptor) {
  struct stat info {};
  return ::fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode);
}

// Returns the errno with which the call must fail now, or 0.
int fault(const std::atomic<int>& call) {
  const int error = call;
  return error != 0 && prism::test::failures_left > 0 ? error : 0;
}

int failed(int error) {
  --prism::test::failures_left;
  errno = error;
  return -1;
}

}  // namespace

extern "C" {

ssize_t write(int descriptor, const void* bytes, size_t size) {
  const int error = fault(prism::test::failing_write);
  if (error != 0 && is_regular(descriptor)) {
    const long left = prism::test::writable_bytes;
    if (left <= 0) return failed(error);
    size = std::min(size, static_cast<size_t>(left));
    prism::test::writable_bytes -= static_cast<long>(size);
  }
  return ::syscall(SYS_write, descriptor, bytes, size);
}

int fdatasync(int descriptor) {
  const int error = fault(prism::test::failing_fdatasync);
  return error != 0 ? failed(error) : static_cast<int>(::syscall(SYS_fdatasync, descriptor));
}

int ftruncate(int descriptor, off_t length) noexcept {
  const int error = fault(prism::test::failing_ftruncate);
  return error != 0 ? failed(error) : static_cast<int>(::syscall(SYS_ftruncate, descriptor, length));
}

dirent* readdir(DIR* folder) {
  static const auto real = reinterpret_cast<dirent* (*)(DIR*)>(::dlsym(RTLD_NEXT, "readdir"));
  ++prism::test::entries_read;
  const int error = fault(prism::test::failing_readdir);
  if (error == 0 || prism::test::readable_entries-- > 0) return real(folder);
  failed(error);
  return nullptr;
}
}
