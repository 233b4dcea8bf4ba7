// SPDX-License-Identifier: MIT
// System calls that fail on request, for errors that cannot be caused with real files.
#pragma once

#include <atomic>
#include <climits>

namespace prism::test {

inline std::atomic<int> failures_left{0};

/// During its lifetime, one system call fails on regular files and directories with `error` (errno), `times` times.
class FailingCall {
 public:
  FailingCall(std::atomic<int>& call, int error, int times = INT_MAX) : call_(call) {
    failures_left = times;
    call_ = error;
  }
  ~FailingCall() { call_ = 0; }
  FailingCall(const FailingCall&) = delete;
  FailingCall& operator=(const FailingCall&) = delete;

 private:
  std::atomic<int>& call_;
};

inline std::atomic<int> failing_write{0};      ///< write(2)
inline std::atomic<int> failing_fdatasync{0};  ///< fdatasync(2)
inline std::atomic<int> failing_ftruncate{0};  ///< ftruncate(2)
inline std::atomic<int> failing_readdir{0};    ///< readdir(3), as std::filesystem calls it
/// Bytes that write(2) accepts before failing_write starts.
inline std::atomic<long> writable_bytes{0};
inline std::atomic<long> entries_read{0};  ///< calls of readdir(3)
/// Entries that readdir(3) gives, "." and ".." among them, before failing_readdir begins.
inline std::atomic<long> readable_entries{0};

}  // namespace prism::test
